//! The marked plate as a photograph would show it.

use crate::histogram::Histogram;
use crate::lettering::Canvas;
use ftheta_model::dose::{DoseMap, TILE_PIXELS};
use kurbo::{Line, Point, Rect};

/// Brightness of the bare plate, of a mark and of the ground it lies on.
const PLATE: f32 = 0.15;
const MARK: f32 = 0.90;
const GROUND: f32 = 0.955;
/// Dose below which nothing is seen, and by which it is, over the typical dose.
const THRESHOLD: f32 = 0.12;
const RESPONSE: f32 = 0.5;

/// How the picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateOptions {
    /// Size of the page around the field's centre, mm; shown whole if the marks fill a good part of
    /// it. `None` shows the marks and a margin.
    pub page_mm: Option<[f64; 2]>,
    /// Longest side of the picture, pixels.
    pub longest_side_px: u32,
}

impl Default for PlateOptions {
    /// The marks and a margin, 2 000 pixels.
    fn default() -> Self {
        Self { page_mm: None, longest_side_px: 2000 }
    }
}

/// A PNG of the marked plate: dark anodised aluminium, bright where the dose was enough.
///
/// Brightness follows the dose from a threshold to saturation, relative to the dose that half of
/// the energy fell on, so that it says where and how evenly, not how much. The grain is a fixed
/// hash: the same map gives the same bytes.
pub fn plate_png(dose: &DoseMap, options: &PlateOptions) -> Vec<u8> {
    let typical_j = typical_energy_j(dose);
    let area_mm = shown_area(dose, typical_j, options.page_mm);
    let scene = Scene::new(area_mm, options.longest_side_px);
    let response = response(dose, typical_j, &scene);
    let mut canvas =
        Canvas { width: scene.width, pixels: vec![GROUND; scene.width * scene.height] };
    for y in 0..scene.height {
        for x in 0..scene.width {
            let plate = scene.plate_at(x, y, &response);
            let pixel = &mut canvas.pixels[y * scene.width + x];
            *pixel = plate.0 + plate.1 * *pixel;
        }
    }
    draw_scale(&mut canvas, &scene);
    encode(&canvas)
}

/// Where the plate lies in the picture.
struct Scene {
    width: usize,
    height: usize,
    /// Left and top border, pixels.
    border: usize,
    /// Pixels of the plate.
    plate_width: usize,
    plate_height: usize,
    /// Left and top of the plate in the field, and a pixel's side, mm.
    left_mm: f64,
    top_mm: f64,
    pixel_mm: f64,
}

impl Scene {
    fn new(area_mm: Rect, longest_side_px: u32) -> Self {
        let longest = f64::from(longest_side_px.clamp(200, 4000));
        let border = (0.03 * longest).round();
        let foot = (0.035 * longest).round();
        let pixel_mm = (area_mm.width() / (longest - 2.0 * border))
            .max(area_mm.height() / (longest - 2.0 * border - foot));
        let plate_width = (area_mm.width() / pixel_mm).round().max(8.0);
        let plate_height = (area_mm.height() / pixel_mm).round().max(8.0);
        Self {
            width: (plate_width + 2.0 * border) as usize,
            height: (plate_height + 2.0 * border + foot) as usize,
            border: border as usize,
            plate_width: plate_width as usize,
            plate_height: plate_height as usize,
            left_mm: area_mm.x0,
            top_mm: area_mm.y1,
            pixel_mm,
        }
    }

    /// Brightness that the plate gives a pixel, and the share of the ground that is seen.
    fn plate_at(&self, x: usize, y: usize, response: &[f32]) -> (f32, f32) {
        let (w, h) = (self.plate_width as f32, self.plate_height as f32);
        let (px, py) = (x as f32 - self.border as f32 + 0.5, y as f32 - self.border as f32 + 0.5);
        let unit = self.width.max(self.height) as f32;
        let edge = rounded_distance(px, py, w, h, 0.012 * unit);
        let lift = 0.006 * unit;
        let below = rounded_distance(px - 0.3 * lift, py - 0.8 * lift, w, h, 0.012 * unit);
        let shade = 1.0 - 0.38 * (-(below.max(0.0)) / (1.1 * lift)).exp();
        let cover = (0.5 - edge).clamp(0.0, 1.0);
        if cover == 0.0 {
            return (0.0, shade);
        }
        let (u, v) = (px / w, py / h);
        let band = (-((u + 0.35 * v - 0.45) / 0.38).powi(2)).exp();
        let light = 0.86 + 0.24 * band - 0.12 * ((u - 0.5).powi(2) + (v - 0.5).powi(2));
        let fine = 1200.0 / unit;
        let (bx, by) = (px * fine, py * fine);
        let brush = 0.5 * noise(bx / 150.0, by * 0.9, 1)
            + 0.3 * noise(bx / 40.0, by * 1.7, 2)
            + 0.2 * noise(bx / 9.0, by * 1.1, 3);
        let bevel = 0.10 * (-(edge + 2.0).abs() / 1.5).exp() * (1.0 - 1.6 * v);
        let plate = PLATE * light * (1.0 + 0.22 * (brush - 0.5)) + bevel;
        let inside = px >= 0.0 && py >= 0.0 && px < w && py < h;
        let marked = match inside {
            // The eye opens up for fine lines, so a part of a pixel counts more than its share.
            true => response[py as usize * self.plate_width + px as usize].min(1.0).powf(0.7),
            false => 0.0,
        };
        let grain = noise(px * 0.45, py * 0.45, 4);
        let mark = MARK * (0.72 + 0.28 * light) * (1.0 + 0.07 * (grain - 0.5));
        let brightness = plate + marked * (mark - plate);
        (cover * brightness, (1.0 - cover) * shade)
    }
}

/// Energy per pixel of the map that half of all energy exceeds, J.
fn typical_energy_j(dose: &DoseMap) -> f32 {
    let mut energies = Histogram::new(1e-18, 1e6, 6);
    for &energy_j in dose.tiles.values().flat_map(|tile| tile.iter()) {
        if energy_j > 0.0 {
            energies.add(f64::from(energy_j), f64::from(energy_j));
        }
    }
    (energies.percentile(0.5) as f32).max(f32::MIN_POSITIVE)
}

/// The part of the field that is shown, mm.
fn shown_area(dose: &DoseMap, typical_j: f32, page_mm: Option<[f64; 2]>) -> Rect {
    let mut seen: Option<Rect> = None;
    for (key, tile) in &dose.tiles {
        for (at, _) in tile.iter().enumerate().filter(|e| *e.1 > 0.05 * typical_j) {
            let (i, j) = pixel_of(*key, at);
            let place = Point::new(f64::from(i) * dose.pixel_mm, f64::from(j) * dose.pixel_mm);
            seen = Some(match seen {
                Some(area) => area.union_pt(place),
                None => Rect::from_points(place, place),
            });
        }
    }
    let page = page_mm
        .filter(|size| size[0] > 0.0 && size[1] > 0.0)
        .map(|[w, h]| Rect::new(-0.5 * w, -0.5 * h, 0.5 * w, 0.5 * h));
    let Some(seen) = seen else {
        return page.unwrap_or(Rect::new(-10.0, -10.0, 10.0, 10.0));
    };
    let margin_mm = (0.08 * seen.width().max(seen.height())).max(0.5);
    let close = seen.inflate(margin_mm, margin_mm);
    match page {
        // A page that the marks hardly fill would only make them small.
        Some(page) if page.union(seen) == page && page.area() < 2.5 * close.area() => page,
        _ => close,
    }
}

fn pixel_of(key: (i32, i32), at: usize) -> (i32, i32) {
    let side = TILE_PIXELS as i32;
    let at = at as i32;
    (key.1 * side + at % side, key.0 * side + at / side)
}

/// How far each pixel of the plate is marked, 0 to 1.
fn response(dose: &DoseMap, typical_j: f32, scene: &Scene) -> Vec<f32> {
    let mut marked = vec![0.0f32; scene.plate_width * scene.plate_height];
    let across = |i: i32, n: usize, to_px: &dyn Fn(f64) -> f64| {
        let size_px = dose.pixel_mm / scene.pixel_mm;
        spread(to_px(f64::from(i) * dose.pixel_mm), size_px, n)
    };
    let side = TILE_PIXELS as i32;
    for (key, tile) in &dose.tiles {
        let x_px = |x_mm: f64| (x_mm - scene.left_mm) / scene.pixel_mm;
        let y_px = |y_mm: f64| (scene.top_mm - y_mm) / scene.pixel_mm;
        let columns: Vec<_> =
            (0..side).map(|i| across(key.1 * side + i, scene.plate_width, &x_px)).collect();
        let rows: Vec<_> =
            (0..side).map(|j| across(key.0 * side + j, scene.plate_height, &y_px)).collect();
        for (at, &energy_j) in tile.iter().enumerate() {
            let over = energy_j / typical_j - THRESHOLD;
            if over <= 0.0 {
                continue;
            }
            let share = 1.0 - (-(over / RESPONSE).powf(1.3)).exp();
            let (x0, columns) = &columns[at % TILE_PIXELS];
            let (y0, rows) = &rows[at / TILE_PIXELS];
            for (y, row) in rows.iter().enumerate() {
                let start = (y0 + y) * scene.plate_width + x0;
                for (x, column) in columns.iter().enumerate() {
                    marked[start + x] += share * row * column;
                }
            }
        }
    }
    expose(&mut marked);
    marked
}

/// Brightens as a camera would, so that lines finer than a pixel are not lost.
fn expose(marked: &mut [f32]) {
    let mut seen = Histogram::new(1e-3, 1e3, 4);
    for &share in marked.iter().filter(|share| **share > 0.05) {
        seen.add(f64::from(share), 1.0);
    }
    let gain = (0.85 / seen.percentile(0.7).max(1e-3)).clamp(1.0, 3.5) as f32;
    marked.iter_mut().for_each(|share| *share = (gain * *share).min(1.0));
}

/// Shares that picture pixels take of a map pixel around `centre_px`: by overlap where map pixels
/// are smaller, linearly interpolated where they are larger. First pixel, and shares from there on.
fn spread(centre_px: f64, size_px: f64, n: usize) -> (usize, Vec<f32>) {
    // As soft as a lens, so that a fine line stays even when the picture is scaled.
    let width_px = size_px.max(1.6);
    let reach_px = if size_px > 1.0 { size_px } else { 0.5 * width_px };
    let first = (centre_px - reach_px).floor().max(0.0) as usize;
    let end = ((centre_px + reach_px).ceil().max(0.0) as usize).min(n);
    let share = |k: usize| {
        let (lo, hi) = (k as f64, k as f64 + 1.0);
        if size_px > 1.0 {
            return (1.0 - (lo + 0.5 - centre_px).abs() / size_px).max(0.0);
        }
        let overlap_px = hi.min(centre_px + reach_px) - lo.max(centre_px - reach_px);
        overlap_px.max(0.0) * size_px / width_px
    };
    let shares = (first..end).map(|k| share(k) as f32).collect();
    (first.min(n), shares)
}

/// Signed distance from the edge of a rounded rectangle at the origin, negative inside.
fn rounded_distance(x: f32, y: f32, w: f32, h: f32, radius: f32) -> f32 {
    let dx = (x - 0.5 * w).abs() - (0.5 * w - radius);
    let dy = (y - 0.5 * h).abs() - (0.5 * h - radius);
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0) - radius
}

/// Smooth noise from 0 to 1 with features of one unit.
fn noise(x: f32, y: f32, salt: u32) -> f32 {
    let (x0, y0) = (x.floor(), y.floor());
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (smooth(x - x0), smooth(y - y0));
    let at = |i: f32, j: f32| hash((x0 + i) as i32, (y0 + j) as i32, salt);
    let row = |j: f32| at(0.0, j) + tx * (at(1.0, j) - at(0.0, j));
    row(0.0) + ty * (row(1.0) - row(0.0))
}

/// A fixed value from 0 to 1 for every pair of numbers.
fn hash(x: i32, y: i32, salt: u32) -> f32 {
    let mut mixed = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    mixed ^= salt.wrapping_mul(0xC2B2_AE3D);
    mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2C1B_3C6D);
    mixed = (mixed ^ (mixed >> 12)).wrapping_mul(0x297A_2D39);
    ((mixed ^ (mixed >> 15)) >> 8) as f32 / (1 << 24) as f32
}

fn draw_scale(canvas: &mut Canvas, scene: &Scene) {
    let unit_px = scene.width.max(scene.height) as f64;
    let longest_mm = 0.22 * scene.plate_width as f64 * scene.pixel_mm;
    let power = 10f64.powf(longest_mm.log10().floor());
    let steps = [5.0, 2.0, 1.0].into_iter();
    let length_mm =
        steps.map(|step| step * power).find(|length_mm| *length_mm <= longest_mm).unwrap_or(power);
    let length_px = length_mm / scene.pixel_mm;
    let right = (scene.border + scene.plate_width) as f64;
    let y = scene.height as f64 - 0.026 * unit_px;
    let left = right - length_px;
    let thick_px = (0.0014 * unit_px).max(1.2);
    let ink = 0.32;
    let ends = (Point::new(left, y), Point::new(right, y));
    canvas.line(Line::new(ends.0, ends.1), thick_px, ink);
    for end in [ends.0, ends.1] {
        let tick = 0.005 * unit_px;
        let line = Line::new((end.x, end.y - tick), (end.x, end.y + tick));
        canvas.line(line, thick_px, ink);
    }
    let height_px = 0.0125 * unit_px;
    let label = format!("{length_mm} mm");
    let foot = Point::new(left - 3.6 * height_px, y + 0.5 * height_px);
    canvas.text(&label, foot, height_px, ink);
}

/// Shades from black over cool dark to warm light, more of them in the dark.
fn palette() -> Vec<u8> {
    let shades = (0..256).map(|i| (i as f32 / 255.0).powf(1.5));
    shades
        .flat_map(|b| {
            let tint = [0.965 + 0.035 * b, 0.99, 1.06 - 0.085 * b];
            tint.map(|t| (255.0 * b * t).round().min(255.0) as u8)
        })
        .collect()
}

fn encode(canvas: &Canvas) -> Vec<u8> {
    let height = canvas.pixels.len() / canvas.width;
    let shades: Vec<u8> = canvas
        .pixels
        .iter()
        .enumerate()
        .map(|(i, &brightness)| {
            // Half a shade of grain hides the steps between shades.
            let grain = hash((i % canvas.width) as i32, (i / canvas.width) as i32, 9) - 0.5;
            let level = 255.0 * brightness.clamp(0.0, 1.0).powf(1.0 / 1.5);
            (level + 0.6 * grain).round().clamp(0.0, 255.0) as u8
        })
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, canvas.width as u32, height as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette());
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_compression(png::Compression::Balanced);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&shades));
    written.expect("writing to memory does not fail, and the sizes agree");
    bytes
}
