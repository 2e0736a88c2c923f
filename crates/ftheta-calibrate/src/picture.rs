//! Where the marks of a grid are, from a picture of it.
//!
//! [`find_field`] is the entry. What tells lengths is a printed sheet with signs around the grid, a
//! scanner's scale, or a camera whose view of the plane is known.

pub mod camera;
mod candidates;
mod centre;
pub mod error;
mod grid;
mod guess;
mod lattice;
mod quad;
pub mod sheet;
mod signs;
mod view_fit;

use crate::raster::flat::Flat;
use candidates::{Ground, Shape};
use error::PictureError;
use ftheta_model::pattern::Pattern;
use ftheta_model::picture::{Picture, PixelPoint, Sighting};
use ftheta_model::space::FieldPoint;
use ftheta_physics::camera::{CameraLens, Seen, View};
use grid::{Grid, Lie};
use lattice::Lattice;
use sheet::{SignsFound, fiducials, signs_of};
use view_fit::fit_view;

/// Signs are no farther off the fitted view than this, px rms, or as far as printers are off, mm.
const BENT_PX: f64 = 0.6;
const BENT_MM: f64 = 0.04;
/// Turns of a grid on its sheet that are tried, degrees: plates are laid by hand.
const TURNS_DEG: [f64; 7] = [0.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0];
/// Smallest mark, px.
const SIZE_MIN_PX: f64 = 10.0;
/// Two marks nearer than this, by half of one, are the same.
const SAME: f64 = 0.5;
/// Marks beside the grid, by its own, that are another grid.
const BESIDE_SHARE: f64 = 0.2;
const N_BESIDE: usize = 8;
/// Brightness that counts as cut off, and the share of marks that may lie on it, percent.
const WHITE: f32 = 0.985;
const SATURATED_PERCENT: f64 = 10.0;
/// Lines are no wider than this part of a mark.
const BLURRED: f64 = 0.3;
/// Least contrast, of full scale and in deviations of the noise.
const CONTRAST_MIN: f64 = 0.02;
const CONTRAST_NOISE: f64 = 4.0;

/// What is known beside picture and pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureOptions {
    /// What the sheet's printed lines along x and y measure, mm.
    pub sheet_mm: [Option<f64>; 2],
    /// The camera's lens; fitted to the signs if `None`.
    pub lens: Option<CameraLens>,
    /// The camera's view of the plane, where it stands still.
    pub view: Option<View>,
    /// Width and height of the pictures that lens or view were made from.
    pub size_px: Option<[usize; 2]>,
    /// Side of a pixel, mm, of a scanner.
    pub mm_per_px: Option<f64>,
    /// How the field's own place and turn are taken.
    pub placement: Placement,
}

/// Where the field lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// Where its marks say: a sheet that was laid by hand says nothing of it.
    #[default]
    Marks,
    /// Where the sheet says: it lies true on the machine's axes.
    Sheet,
}

/// Marks of a pattern as a picture shows them.
#[derive(Clone, Debug)]
pub struct FieldSeen {
    /// Every mark of the pattern, in its order.
    pub marks: Vec<MarkSeen>,
    /// The sheet's signs.
    pub signs: Vec<SignSeen>,
    /// What looks like a mark and is none of the grid.
    pub extra: Vec<PixelPoint>,
    /// Whether marks are brighter than the ground.
    pub bright: bool,
    /// Scale in the middle of the grid, mm/px.
    pub mm_per_px: f64,
    /// What the signs are off the fitted view, px rms; 0 without signs.
    pub view_rms_px: f64,
    /// The camera's view, if it was fitted or known.
    pub view: Option<View>,
    /// Whether signs or a known view tell which way the grid lies; if not it is as the picture was
    /// taken.
    pub oriented: bool,
}

/// A mark of the pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkSeen {
    /// Its name.
    pub id: String,
    /// Where it should be, mm.
    pub target_mm: FieldPoint,
    /// Where it is in the picture; `None` if it was not found.
    pub pixel: Option<PixelPoint>,
    /// Where that is in the field, mm.
    pub measured_mm: Option<FieldPoint>,
}

/// A printed sign in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignSeen {
    /// Its number.
    pub number: usize,
    /// Its corners.
    pub corners: [PixelPoint; 4],
    /// Whether the view was fitted to it.
    pub kept: bool,
}

impl SignSeen {
    /// Whether a pixel lies in the sign.
    fn holds(&self, pixel: PixelPoint) -> bool {
        let corners = &self.corners;
        (0..4).all(|index| {
            let (a, b) = (corners[index], corners[(index + 1) % 4]);
            // Clockwise with y down, the inside is to the right.
            (b.x_px - a.x_px) * (pixel.y_px - a.y_px) > (b.y_px - a.y_px) * (pixel.x_px - a.x_px)
        })
    }
}

/// What tells lengths in a picture.
enum Ruler {
    /// A view of the plane.
    View(Box<KnownView>),
    /// A scanner.
    Scale(f64),
}

/// A view of the plane, with signs if they gave it.
struct KnownView {
    view: View,
    seen: Seen,
    rms_px: f64,
    signs: Vec<SignSeen>,
}

/// Finds the marks of a pattern's grid in a picture.
///
/// # Errors
/// If the picture does not show the pattern, or not well enough, or nothing tells lengths.
pub fn find_field(
    picture: &Picture,
    pattern: &Pattern,
    options: &PictureOptions,
) -> Result<FieldSeen, PictureError> {
    let grid = Grid::new(pattern)?;
    let found = [picture.width(), picture.height()];
    if let Some(known) = options.size_px.filter(|known| *known != found) {
        return Err(PictureError::OtherSize { found, known });
    }
    let flat = Flat::new(picture);
    contrast(&flat)?;
    let ruler = ruler(picture, &flat, pattern, options)?;
    let (found, low) = match &ruler {
        Ruler::View(known) => on_sheet(picture, &flat, &grid, known)?,
        Ruler::Scale(_) => {
            let found = without_signs(picture, &flat, &grid)?;
            let low = grid.anchored(&found.lattice, &found.marks, None)?;
            (found, low)
        }
    };
    let pixels = grid.pixels(&found.lattice, &found.marks, low);
    judge(picture, &grid, &found, &pixels)?;
    Ok(assembled(&grid, found, pixels, ruler, options.placement))
}

/// Centres of a pattern's marks in a picture of which nothing is known, for those who have a ruler
/// of their own: as [`find_field`] finds them, without lengths.
///
/// # Errors
/// If the picture does not show the pattern, or not well enough.
pub fn find_marks(picture: &Picture, pattern: &Pattern) -> Result<Vec<MarkSeen>, PictureError> {
    let options = PictureOptions { mm_per_px: Some(1.0), ..PictureOptions::default() };
    Ok(find_field(picture, pattern, &options)?.marks)
}

fn contrast(flat: &Flat) -> Result<(), PictureError> {
    let contrast = flat.extremes[1].max(-flat.extremes[0]);
    let limit = CONTRAST_MIN.max(CONTRAST_NOISE * flat.noise_left);
    match contrast < limit {
        true => Err(PictureError::NoContrast { contrast, noise: flat.noise, limit }),
        false => Ok(()),
    }
}

fn ruler(
    picture: &Picture,
    flat: &Flat,
    pattern: &Pattern,
    options: &PictureOptions,
) -> Result<Ruler, PictureError> {
    if let Some(view) = options.view {
        let seen = view.inverse().ok_or(PictureError::NoScale)?;
        let known = KnownView { view, seen, rms_px: 0.0, signs: Vec::new() };
        return Ok(Ruler::View(Box::new(known)));
    }
    if let Some(mm_per_px) = options.mm_per_px {
        return Ok(Ruler::Scale(mm_per_px));
    }
    let SignsFound { found, sightings, limit } = signs_of(picture, flat, pattern, options)?;
    let size_px = [picture.width(), picture.height()];
    let n_signs = fiducials(pattern).len();
    let few = PictureError::FewSigns { n_found: sightings.len(), n_signs, limit };
    let fitted = fit_view(&sightings, size_px, options.lens).ok_or(few)?;
    let n_kept = fitted.kept.iter().filter(|kept| **kept).count();
    let limit_px = BENT_PX.max(BENT_MM * px_per_mm(&fitted.view));
    if n_kept < limit || fitted.rms_px > limit_px {
        return Err(PictureError::Bent { rms_px: fitted.rms_px, limit_px });
    }
    let signs = found.iter().zip(&fitted.kept).map(|(sign, &kept)| SignSeen {
        number: sign.number,
        corners: sign.corners,
        kept,
    });
    let signs = signs.collect();
    let view_fit::FittedView { view, seen, rms_px, .. } = fitted;
    Ok(Ruler::View(Box::new(KnownView { view, seen, rms_px, signs })))
}

/// Scale in the middle of the plane.
fn px_per_mm(view: &View) -> f64 {
    let at = |x: f64| view.pixel(FieldPoint::new(x, 0.0));
    at(0.0).zip(at(1.0)).map_or(0.0, |(a, b)| a.distance(b))
}

/// How marks look, and how far they are from each other, at a place of the picture.
struct Looks<'a> {
    shape: &'a dyn Fn(PixelPoint) -> Option<Shape>,
    ways: &'a dyn Fn(PixelPoint) -> Option<[[f64; 2]; 2]>,
}

/// Marks that were found, and which of them form the grid.
struct Found {
    bright: bool,
    marks: Vec<PixelPoint>,
    lattice: Lattice,
}

/// Finds marks and puts them in order.
fn indexed(
    picture: &Picture,
    flat: &Flat,
    grid: &Grid,
    looks: &Looks<'_>,
) -> Result<Found, PictureError> {
    let ground = Ground { off: &flat.off, width: picture.width(), noise: flat.noise_left };
    let (bright, list) = candidates::candidates(&ground, looks.shape, grid.n_marks());
    // Some times as many as there can be is enough, and bounds the work on gravel.
    let most = 4 * grid.n_marks() + 100;
    let mut marks: Vec<PixelPoint> = Vec::new();
    for candidate in list.iter().take(most) {
        let Some(shape) = (looks.shape)(candidate.pixel) else { continue };
        let centre = centre::centre(picture, bright, &shape, candidate.pixel);
        // Two candidates may lead to the same mark.
        let limit_px = SAME * shape.reach_px();
        let new = |centre: &PixelPoint| marks.iter().all(|mark| mark.distance(*centre) > limit_px);
        let centre = centre.filter(new);
        marks.extend(centre);
    }
    let mut all = lattice::lattices(&marks, looks.ways).into_iter();
    let mut lattice = all.next().unwrap_or_default();
    lattice::trim(&mut lattice, grid.size());
    lattice::smooth(&mut lattice, &marks);
    let n_beside = all.next().map_or(0, |second| second.len());
    if n_beside > N_BESIDE.max((BESIDE_SHARE * lattice.len() as f64) as usize) {
        return Err(PictureError::TwoGrids { n_marks: lattice.len(), n_beside });
    }
    Ok(Found { bright, marks, lattice })
}

/// Finds marks on a sheet, and which column and row is the lattice's first.
fn on_sheet(
    picture: &Picture,
    flat: &Flat,
    grid: &Grid,
    known: &KnownView,
) -> Result<(Found, [i32; 2]), PictureError> {
    let KnownView { view, seen, signs, .. } = known;
    let in_sign = |pixel: PixelPoint| signs.iter().any(|sign| sign.holds(pixel));
    let mut best = Err(grid.few(0));
    let mut n_most = 0;
    for turn_deg in TURNS_DEG {
        let lie = Lie { view, seen, turn_rad: turn_deg.to_radians() };
        let shape = |pixel: PixelPoint| grid.shape(&lie, pixel).filter(|_| !in_sign(pixel));
        let ways = |pixel: PixelPoint| grid.ways(&lie, pixel);
        let found = indexed(picture, flat, grid, &Looks { shape: &shape, ways: &ways })?;
        let n_found = found.lattice.len();
        if n_found > n_most {
            n_most = n_found;
            let low = grid.anchored(&found.lattice, &found.marks, Some(&lie));
            best = low.map(|low| (found, low));
        }
        if n_found >= grid.n_least() {
            break;
        }
    }
    best
}

/// Finds marks whose size and direction is guessed at first, and known once their grid is.
fn without_signs(picture: &Picture, flat: &Flat, grid: &Grid) -> Result<Found, PictureError> {
    let guess = guess::guess(flat, picture.width(), grid.style()).ok_or_else(|| grid.few(0))?;
    let shape = |_: PixelPoint| Some(guess.shape);
    let ways = |_: PixelPoint| Some(guess.ways_px);
    let first = indexed(picture, flat, grid, &Looks { shape: &shape, ways: &ways })?;
    let low = grid.anchored(&first.lattice, &first.marks, None)?;
    // As far as a camera sees them, marks are where the pattern has them.
    let groups: Vec<Vec<Sighting>> = grid
        .pixels(&first.lattice, &first.marks, low)
        .into_iter()
        .zip(&grid.marks)
        .filter_map(|(pixel, mark)| Some(vec![Sighting { place_mm: mark.place_mm, pixel: pixel? }]))
        .collect();
    let size_px = [picture.width(), picture.height()];
    let Some(fitted) = fit_view(&groups, size_px, None) else { return Ok(first) };
    let lie = Lie { view: &fitted.view, seen: &fitted.seen, turn_rad: 0.0 };
    let shape = |pixel: PixelPoint| grid.shape(&lie, pixel);
    let ways = |pixel: PixelPoint| grid.ways(&lie, pixel);
    indexed(picture, flat, grid, &Looks { shape: &shape, ways: &ways })
}

/// Whether what was found may be used.
fn judge(
    picture: &Picture,
    grid: &Grid,
    found: &Found,
    pixels: &[Option<PixelPoint>],
) -> Result<(), PictureError> {
    let n_found = pixels.iter().flatten().count();
    let saturated = |pixel: &&PixelPoint| {
        // The ground beside a mark, on its diagonals.
        let off = 0.2 * grid.size_px(pixels);
        let corners = [(off, off), (-off, off), (off, -off), (-off, -off)];
        let places = corners.map(|(x, y)| PixelPoint::new(pixel.x_px + x, pixel.y_px + y));
        let n_white = places.iter().filter(|place| picture.at(**place) > WHITE).count();
        !found.bright && n_white > 2
    };
    let n_white = pixels.iter().flatten().filter(saturated).count();
    let share = 100.0 * n_white as f64 / n_found.max(1) as f64;
    if share > SATURATED_PERCENT {
        return Err(PictureError::Saturated { share, limit: SATURATED_PERCENT });
    }
    let size_px = grid.size_px(pixels);
    if n_found > 0 && size_px < SIZE_MIN_PX {
        return Err(PictureError::Coarse { size_px, limit_px: SIZE_MIN_PX });
    }
    if n_found < grid.n_least() {
        return Err(grid.few(n_found));
    }
    let limit_px = BLURRED * size_px;
    match grid.line_width_px(picture, found.bright, pixels) {
        Some(width_px) if width_px > limit_px => {
            Err(PictureError::Blurred { width_px, size_px, limit_px })
        }
        _ => Ok(()),
    }
}

fn assembled(
    grid: &Grid,
    found: Found,
    pixels: Vec<Option<PixelPoint>>,
    ruler: Ruler,
    placement: Placement,
) -> FieldSeen {
    let measured: Vec<Option<FieldPoint>> = match &ruler {
        Ruler::View(known) => {
            let place = |pixel: &Option<PixelPoint>| known.seen.place((*pixel)?);
            pixels.iter().map(place).collect()
        }
        Ruler::Scale(mm_per_px) => pixels
            .iter()
            .map(|pixel| pixel.map(|p| FieldPoint::new(mm_per_px * p.x_px, -mm_per_px * p.y_px)))
            .collect(),
    };
    let scanned = matches!(ruler, Ruler::Scale(_));
    let measured = match placement {
        Placement::Sheet if !scanned => measured,
        _ => grid.placed_by_marks(&measured),
    };
    let in_grid: std::collections::HashSet<usize> = found.lattice.values().copied().collect();
    let extra = found.marks.iter().enumerate().filter(|(index, _)| !in_grid.contains(index));
    let extra = extra.map(|(_, pixel)| *pixel).collect();
    let mm_per_px = grid.size_mm() / grid.size_px(&pixels).max(f64::MIN_POSITIVE);
    let marks = grid.marks.iter().zip(pixels).zip(measured);
    let marks = marks.map(|((mark, pixel), measured_mm)| MarkSeen {
        id: mark.id.clone(),
        target_mm: mark.place_mm,
        pixel,
        measured_mm,
    });
    let marks = marks.collect();
    let (view, view_rms_px, signs) = match ruler {
        Ruler::View(known) => (Some(known.view), known.rms_px, known.signs),
        Ruler::Scale(_) => (None, 0.0, Vec::new()),
    };
    let (bright, oriented) = (found.bright, view.is_some());
    FieldSeen { marks, signs, extra, bright, mm_per_px, view_rms_px, view, oriented }
}
