//! Grids on printed sheets that the twin burns and photographs, and what is found in the picture.
#![allow(dead_code, reason = "test and example each use a part")]

use ftheta::calibrate::picture::error::PictureError;
use ftheta::calibrate::picture::{FieldSeen, PictureOptions, Placement, find_field};
use ftheta::machines;
use ftheta::model::machine::Machine;
use ftheta::model::pattern::{MarkStyle, Pattern};
use ftheta::pattern::fiducials;
use ftheta::pattern::grid::{self, GridOptions};
use ftheta::pattern::sheet::SheetProcess;
use ftheta::photograph::{Photograph, PhotographOptions, photograph};

/// A grid on its sheet.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    pub style: MarkStyle,
    pub n_side: u32,
    pub field_mm: f64,
    /// Whether print is off by some tenths of a percent, and sign by sign.
    pub print_errors: bool,
}

/// How right a picture was.
#[derive(Clone, Copy, Debug)]
pub struct Tally {
    pub n_burned: usize,
    /// Marks that were burned and not found.
    pub n_lost: usize,
    /// Marks that were found and not burned, or far from where they are.
    pub n_false: usize,
    /// Off the true place in the picture, px rms along an axis.
    pub off_px: f64,
    /// Off the true place in the field, µm rms along an axis.
    pub off_um: f64,
    /// The same less a common place, turn and scale of each axis.
    pub left_um: f64,
}

/// A mark is false from here on, px.
const FALSE_PX: f64 = 3.0;
/// What a fibre across a mark moves is the calibration's to find: counted up to here, px and mm.
const FIBRE: [f64; 2] = [0.3, 0.05];

pub fn machine() -> Machine {
    machines::find("S14-f420").unwrap()
}

impl Sheet {
    pub fn new(style: MarkStyle, n_side: u32, field_mm: f64) -> Self {
        Self { style, n_side, field_mm, print_errors: true }
    }

    pub fn pattern(&self) -> Pattern {
        let Self { style, n_side, field_mm, .. } = *self;
        let process = SheetProcess::of(&machine());
        let options = GridOptions { n_side, field_mm, style, size_mm: None, process };
        fiducials::around(grid::sheet(&options, &machine()).unwrap()).unwrap().pattern
    }

    /// A photograph with dirt, burnt centres and missing marks.
    pub fn taken(&self, seed: u64, change: &dyn Fn(&mut PhotographOptions)) -> Photograph {
        let mut options = PhotographOptions::usual(&machine(), seed);
        options.burn.missing = 0.03;
        options.burn.overburn = 3.0;
        options.sensor.n_dirt = 20;
        if !self.print_errors {
            options.print_error = Some([0.0; 2]);
            options.print_noise_mm = 0.0;
        }
        change(&mut options);
        photograph(&self.pattern(), &[], &machine(), &options, &mut |_| {}).unwrap()
    }

    pub fn seen(&self, photograph: &Photograph) -> Result<FieldSeen, PictureError> {
        // A caliper is off too: where print is right its length is known.
        let nominal_mm = photograph.caliper_mm.map(|mm| mm.map(|mm| (0.1 * mm).round() * 10.0));
        let options = PictureOptions {
            sheet_mm: if self.print_errors { photograph.caliper_mm } else { nominal_mm },
            placement: Placement::Sheet,
            ..PictureOptions::default()
        };
        find_field(&photograph.picture, &self.pattern(), &options)
    }

    /// How right the picture of a seed is.
    pub fn tally(&self, seed: u64) -> Result<Tally, PictureError> {
        let photograph = self.taken(seed, &|_| {});
        Ok(tally(&self.seen(&photograph)?, &photograph))
    }
}

/// How right what was seen is.
pub fn tally(seen: &FieldSeen, photograph: &Photograph) -> Tally {
    let truth = &photograph.truth.centres;
    let (mut n_lost, mut n_false, mut px, mut n_px) = (0, 0, 0.0, 0.0);
    let mut off_mm: Vec<[f64; 4]> = Vec::new();
    for mark in &seen.marks {
        let known = truth.iter().find(|(id, _)| *id == mark.id).map(|(_, place)| place);
        let (known, pixel) = match (known, mark.pixel) {
            (None, None) => continue,
            (None, Some(_)) => {
                n_false += 1;
                continue;
            }
            (Some(_), None) => {
                n_lost += 1;
                continue;
            }
            (Some(known), Some(pixel)) => (known, pixel),
        };
        let far = pixel.distance(known.pixel);
        n_false += usize::from(far > FALSE_PX);
        px += far.min(FIBRE[0]).powi(2);
        n_px += 1.0;
        if let Some(place) = mark.measured_mm {
            let off = [place.x_mm - known.place_mm.x_mm, place.y_mm - known.place_mm.y_mm];
            let off = off.map(|mm| mm.clamp(-FIBRE[1], FIBRE[1]));
            off_mm.push([off[0], off[1], known.place_mm.x_mm, known.place_mm.y_mm]);
        }
    }
    let n = off_mm.len() as f64;
    let rms = |all: &[[f64; 4]]| {
        let squares = all.iter().map(|off| off[0] * off[0] + off[1] * off[1]);
        1e3 * (squares.sum::<f64>() / n / 2.0).sqrt()
    };
    let off_um = rms(&off_mm);
    let n_burned = truth.iter().filter(|(id, _)| seen.marks.iter().any(|m| m.id == *id)).count();
    Tally {
        n_burned,
        n_lost,
        n_false,
        off_px: (px / n_px / 2.0).sqrt(),
        off_um,
        left_um: rms(&without_trend(&off_mm)),
    }
}

/// Errors less a place, a turn, and a scale of each axis: what print and caliper are off.
fn without_trend(all: &[[f64; 4]]) -> Vec<[f64; 4]> {
    let n = all.len() as f64;
    let sum = |of: &dyn Fn(&[f64; 4]) -> f64| all.iter().map(of).sum::<f64>();
    let mean = [0, 1, 2, 3].map(|index| sum(&|off| off[index]) / n);
    let xx = sum(&|off| (off[2] - mean[2]).powi(2));
    let yy = sum(&|off| (off[3] - mean[3]).powi(2));
    let slope = |error: usize, place: usize, norm: f64| {
        sum(&|off| (off[error] - mean[error]) * (off[place] - mean[place])) / norm
    };
    let (x_by_x, y_by_y) = (slope(0, 2, xx), slope(1, 3, yy));
    let turn = 0.5 * (slope(1, 2, xx) - slope(0, 3, yy));
    all.iter()
        .map(|off| {
            let (x, y) = (off[2] - mean[2], off[3] - mean[3]);
            let left = [
                off[0] - mean[0] - x_by_x * x + turn * y,
                off[1] - mean[1] - y_by_y * y - turn * x,
            ];
            [left[0], left[1], off[2], off[3]]
        })
        .collect()
}
