//! A photograph of a pattern as the twin burns it: a calibration from pictures, rehearsed.

mod burning;
mod strokes;
pub mod truth;

use crate::Error;
use crate::mark::Stage;
use ftheta_model::job::Shape;
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{FeatureShape, Pattern};
use ftheta_model::picture::Picture;
use ftheta_model::tag;
use ftheta_physics::correction::CorrectionTable;
use ftheta_physics::head::Head;
use ftheta_twin::hidden_head::hidden_head;
use ftheta_twin::mismatch::Mismatch;
use ftheta_twin::photograph::{
    Camera, CameraOptions, Look, Print, Printer, Scene, Segment, Sensor, expose,
};
use kurbo::{Affine, Point, Rect};
use thiserror::Error as ThisError;
use truth::Truth;

/// Side of a pixel for patterns without a sheet, mm.
const PIXEL_MM: f64 = 0.02;
/// What is shown around the outermost things, mm, and as part of their extent.
const MARGIN_MM: f64 = 0.8;
const MARGIN: f64 = 0.02;
/// Most pixels of a picture.
const N_PIXELS_MAX: usize = 100_000_000;
/// Brightness of a bare plate, of the burned one, and of white and black ink.
const DARK_ON_BRIGHT: [f64; 4] = [0.78, 0.16, 0.78, 0.10];
const BRIGHT_ON_DARK: [f64; 4] = [0.22, 0.80, 0.78, 0.08];
/// Unevenness of anodised aluminium: brightness, threshold.
pub const TEXTURE: [f64; 2] = [0.03, 0.05];
/// How far printed signs are off one by one, mm rms along each axis.
pub const PRINT_NOISE_MM: f64 = 0.015;
/// What a caliper reads beside the truth, mm rms.
const CALIPER_MM: f64 = 0.02;

/// How power goes with speed over the lines of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerRule {
    /// As the pattern's power ratios say.
    Stated,
    /// The same for all lines.
    Constant,
    /// In proportion to the speed, so that all lines have the same dose.
    Proportional,
}

/// How the pattern is burned.
#[derive(Clone, Debug)]
pub struct BurnOptions {
    /// The machine as it really is: its laser's latencies are the true ones.
    pub true_machine: Machine,
    /// The head on the twin; none is a perfect one.
    pub head: Option<Head>,
    /// Table to mark through.
    pub table: Option<CorrectionTable>,
    /// How the twin's plant differs from the machine.
    pub mismatch: Mismatch,
    /// How late light appears and ends on top of the true latencies, ns.
    pub late_ns: [i64; 2],
    /// Peak dose of the fastest line over the material's threshold.
    pub dose: f64,
    /// How power goes with speed; `None` takes the pattern's ratios if they differ among the
    /// speeds, and otherwise constant dose.
    pub power: Option<PowerRule>,
    /// By how much the dose of the fastest line is too large and that of the slowest too small,
    /// relative; in between in proportion to the speed.
    pub dose_slope: f64,
    /// How far light is off its place, mm rms, along each axis and for each line alone.
    pub jitter_mm: f64,
    /// 1/e² diameter of the spot, mm; the machine's if `None`.
    pub spot_diameter_mm: Option<f64>,
    /// Peak dose that the first moment of a mark's arm leaves, over that of the arm.
    pub overburn: f64,
    /// Share of marks and lines that are missing.
    pub missing: f64,
}

/// A photograph to be taken.
#[derive(Clone, Debug)]
pub struct PhotographOptions {
    /// How the pattern is burned.
    pub burn: BurnOptions,
    /// The camera; its seed is that of everything else as well.
    pub camera: CameraOptions,
    /// What happens behind the lens.
    pub sensor: Sensor,
    /// Whether the burned is brighter than the plate.
    pub bright: bool,
    /// By how much print is too large along x and y; from the seed if `None`.
    pub print_error: Option<[f64; 2]>,
    /// How far a printed sign is off on top of that, mm rms along each axis.
    pub print_noise_mm: f64,
    /// Where the printed sheet lies in the field: mm along x and y, and degrees anticlockwise.
    pub sheet_lies: [f64; 3],
    /// Unevenness of the material, relative: brightness, threshold.
    pub texture: [f64; 2],
}

impl PhotographOptions {
    /// A phone over anodised aluminium, and a machine that is as its file says but for a head with
    /// errors of its own: what `ftheta twin photograph` takes unless told otherwise.
    pub fn usual(true_machine: &Machine, seed: u64) -> Self {
        Self {
            burn: BurnOptions {
                true_machine: true_machine.clone(),
                head: Some(hidden_head(&true_machine.optics, seed)),
                table: None,
                mismatch: Mismatch::default(),
                late_ns: [0; 2],
                dose: 3.0,
                power: None,
                dose_slope: 0.0,
                jitter_mm: 0.001,
                spot_diameter_mm: None,
                overburn: 1.0,
                missing: 0.0,
            },
            camera: CameraOptions {
                pixel_mm: None,
                megapixels: None,
                tilt_deg: None,
                turn_deg: 0.0,
                mirrored: false,
                distortion: 1.0,
                seed,
            },
            sensor: Sensor {
                blur_px: 0.8,
                noise: 0.02,
                exposure: 1.0,
                unevenness: 1.0,
                glare: 0.0,
                n_dirt: 0,
                gamma: 1.0,
                seed,
            },
            bright: false,
            print_error: None,
            print_noise_mm: PRINT_NOISE_MM,
            sheet_lies: [0.0; 3],
            texture: TEXTURE,
        }
    }
}

/// A photograph, and what is true of it.
#[derive(Clone, Debug)]
pub struct Photograph {
    /// The picture.
    pub picture: Picture,
    /// Where everything is in it.
    pub truth: Truth,
    /// Length of the printed reference lines along x and y as a caliper reads them, mm.
    pub caliper_mm: [Option<f64>; 2],
    /// Side of a pixel on the plate, mm.
    pub pixel_mm: f64,
}

/// Why there is no photograph.
#[derive(Clone, Copy, Debug, ThisError, PartialEq)]
#[non_exhaustive]
pub enum PhotographError {
    /// Nothing to be seen.
    #[error("the pattern has nothing that is burned or printed")]
    Empty,
    /// A sign that nobody can print.
    #[error("fiducial {index} is no {} of number 0 to {}", tag::FAMILY, tag::CODES.len() - 1)]
    Tag {
        /// Which feature of the pattern, from 0.
        index: usize,
    },
    /// More pixels than a picture may have.
    #[error("{width} x {height} pixels are more than the limit of {limit}; show less, or coarser")]
    Size {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Most of them.
        limit: usize,
    },
    /// A camera that sees the plate from its edge.
    #[error("the camera does not see the plate; tilt it less")]
    View,
}

/// Burns a pattern on the twin, and takes a photograph of it.
///
/// * `labels`: what is burned beside the features, as lettering
/// * `observer` is told when a stage begins
///
/// # Errors
/// If the pattern cannot be marked on the machine, or the picture would be too large.
pub fn photograph(
    pattern: &Pattern,
    labels: &[Shape],
    machine: &Machine,
    options: &PhotographOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Photograph, Error> {
    let seed = options.camera.seed;
    let strokes = strokes::strokes(pattern, labels, machine, &options.burn, seed);
    let mut burned = burning::burn(&strokes, machine, &options.burn, observer)?;
    burning::jitter(&mut burned, options.burn.jitter_mm, seed);
    observer(Stage::Finish);
    let [plate, dark, white, black] = if options.bright { BRIGHT_ON_DARK } else { DARK_ON_BRIGHT };
    let [x_mm, y_mm, turn_deg] = options.sheet_lies;
    let lies = Affine::translate((x_mm, y_mm)) * Affine::rotate(turn_deg.to_radians());
    let mut printer = Printer::new(seed, lies, [plate, white, black]);
    printer.noise_mm = options.print_noise_mm;
    if let Some(error) = options.print_error {
        printer.scale = error.map(|error| 1.0 + error);
    }
    let printed = print(pattern, &mut printer)?;
    let segments: Vec<Segment> = burned.iter().flat_map(|run| run.segments.clone()).collect();
    let area = area(&segments, &printed.prints).ok_or(PhotographError::Empty)?;
    let mut camera_options = options.camera;
    if printed.prints.is_empty() && camera_options.megapixels.is_none() {
        camera_options.pixel_mm = camera_options.pixel_mm.or(fine(area));
    }
    let camera = Camera::new(&camera_options, area).ok_or(PhotographError::View)?;
    let (width, height) = (camera.width, camera.height);
    if width.saturating_mul(height) > N_PIXELS_MAX {
        return Err(PhotographError::Size { width, height, limit: N_PIXELS_MAX }.into());
    }
    let spot_mm = options.burn.spot_diameter_mm.unwrap_or(machine.laser.spot_diameter_mm);
    let scene = Scene {
        segments,
        spot_radius_mm: 0.5 * spot_mm,
        threshold_j_mm2: strokes.peak_j_mm2(0.5 * spot_mm) / options.burn.dose,
        prints: printed.prints,
        look: Look {
            plate,
            burned: dark,
            texture: options.texture[0],
            threshold_texture: options.texture[1],
            seed,
        },
    };
    let scene = strokes.overburned(scene, &burned, options.burn.overburn);
    let picture = expose(&scene, &camera, &options.sensor);
    let truth = Truth::new(pattern, &strokes, &burned, &printed.centres, &printer, camera);
    let caliper_mm = caliper(pattern, &mut printer);
    Ok(Photograph { picture, truth, caliper_mm, pixel_mm: truth::pixel_mm(&camera, area.center()) })
}

/// Fine pixels, where the whole is small enough for them.
fn fine(area: Rect) -> Option<f64> {
    (area.width() * area.height() < 12e6 * PIXEL_MM * PIXEL_MM).then_some(PIXEL_MM)
}

/// What is printed, and the centres of its signs by feature.
struct Printed {
    prints: Vec<Print>,
    centres: Vec<(usize, Point)>,
}

fn print(pattern: &Pattern, printer: &mut Printer) -> Result<Printed, PhotographError> {
    let mut printed = Printed { prints: Vec::new(), centres: Vec::new() };
    for (index, feature) in pattern.features.iter().enumerate() {
        match &feature.shape {
            FeatureShape::Fiducial { family, code, place_mm, size_mm, burned: false } => {
                let number = code.parse().ok().filter(|_| family == tag::FAMILY);
                let tag =
                    number.and_then(|number| printer.tag(number, Point::from(*place_mm), *size_mm));
                let (prints, centre) = tag.ok_or(PhotographError::Tag { index })?;
                printed.prints.extend(prints);
                printed.centres.push((index, centre));
            }
            FeatureShape::Reference { from_mm, to_mm, burned: false } => {
                printed.prints.extend(printer.line((*from_mm).into(), (*to_mm).into()));
            }
            _ => {}
        }
    }
    Ok(printed)
}

/// What the printed reference lines measure, the longest along each axis.
fn caliper(pattern: &Pattern, printer: &mut Printer) -> [Option<f64>; 2] {
    let mut longest: [Option<(f64, f64)>; 2] = [None; 2];
    for feature in &pattern.features {
        let FeatureShape::Reference { from_mm, to_mm, burned: false } = &feature.shape else {
            continue;
        };
        let (from, to) = (Point::from(*from_mm), Point::from(*to_mm));
        let along = to - from;
        let axis = usize::from(along.y.abs() > along.x.abs());
        let true_mm = printer.place(from).distance(printer.place(to));
        if longest[axis].is_none_or(|(length_mm, _)| along.hypot() > length_mm) {
            longest[axis] = Some((along.hypot(), true_mm));
        }
    }
    longest.map(|line| line.map(|(_, true_mm)| true_mm + CALIPER_MM * printer.normal()))
}

/// The part of the plate that is shown.
fn area(segments: &[Segment], prints: &[Print]) -> Option<Rect> {
    let burned = segments.iter().map(|segment| Rect::from_points(segment.from, segment.to));
    let printed = prints.iter().map(|print| print.placed.transform_rect_bbox(print.rect));
    let area = burned.chain(printed).reduce(|area, one| area.union(one))?;
    let margin_mm = MARGIN_MM + MARGIN * area.width().max(area.height());
    Some(area.inflate(margin_mm, margin_mm))
}
