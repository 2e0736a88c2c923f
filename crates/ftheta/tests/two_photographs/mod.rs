//! A machine whose head and delays nobody knows, and two photographs that tell them.

use ftheta::atlas_store::AtlasStore;
use ftheta::calibrate::picture::{PictureOptions, Placement, find_field};
use ftheta::delay_calibration::{Apply, calibrate_delay};
use ftheta::field_calibration::{FieldOptions, calibrate_field};
use ftheta::field_picture::{FieldPicture, points};
use ftheta::formats::picture_file::PictureRead;
use ftheta::formats::svg;
use ftheta::machines;
use ftheta::mark::{MarkOptions, mark};
use ftheta::model::machine::Machine;
use ftheta::model::pattern::MarkStyle;
use ftheta::model::recipe::Recipe;
use ftheta::pattern::delay::{self, DelayOptions, Method};
use ftheta::pattern::fiducials;
use ftheta::pattern::grid::{self, GridOptions};
use ftheta::pattern::sheet::SheetProcess;
use ftheta::photograph::{PhotographOptions, photograph};
use ftheta::physics::correction::CorrectionTable;
use ftheta::physics::head::Head;
use ftheta::twin::hidden_head::hidden_head;
use ftheta::twin::mismatch::Mismatch;

/// What nobody knows: how the head was built, and how late its laser is.
pub struct Hidden {
    /// The machine as it really is.
    pub machine: Machine,
    /// The head as it really is.
    pub head: Head,
    seed: u64,
}

/// What is known of it: the data sheet, and what photographs have added.
pub struct Known {
    /// The machine file.
    pub machine: Machine,
    /// The correction of its field.
    pub table: Option<CorrectionTable>,
}

/// How well the machine marks, µm.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// Greatest distance of light from a square of 100 mm.
    pub contour_um: f64,
    /// Greatest error of the ends of lines made at 2 m/s, in a field without errors: what the
    /// delays alone leave.
    pub ends_um: f64,
}

impl Hidden {
    /// A machine from a seed, and its data sheet.
    pub fn new(seed: u64) -> (Self, Known) {
        let sheet = machines::find("S14-f420").unwrap();
        let head = hidden_head(&sheet.optics, seed);
        let mut machine = sheet.clone();
        // 60 to 120 µs late, and off another 10 to 40 µs less.
        let on_ns = 60_000 + (seed * 7919 % 60_000) as i64;
        let off_ns = on_ns - 10_000 - (seed * 104_729 % 30_000) as i64;
        machine.laser.on_latency_ns += on_ns;
        machine.laser.off_latency_ns += off_ns;
        (Self { machine, head, seed }, Known { machine: sheet, table: None })
    }

    /// By how much light is later than the machine file says, ns.
    fn late_ns(&self, known: &Machine) -> [i64; 2] {
        let late =
            |of: fn(&Machine) -> i64| of(&self.machine) - of(known) + known.laser.mirror_delay_ns;
        [late(|m| m.laser.on_latency_ns), late(|m| m.laser.off_latency_ns)]
    }

    fn camera(&self, known: &Known) -> PhotographOptions {
        let mut options = PhotographOptions::usual(&self.machine, self.seed);
        options.burn.head = Some(self.head.clone());
        options.burn.table.clone_from(&known.table);
        options
    }

    /// Marks a comb, photographs it, and takes the laser's delays from the picture.
    pub fn tell_delays(&self, known: &mut Known) {
        let options = DelayOptions::usual(Method::Comb, &known.machine);
        let pattern = delay::sheet(&options, &known.machine).unwrap().pattern;
        let camera = self.camera(known);
        let taken = photograph(&pattern, &[], &known.machine, &camera, &mut |_| {}).unwrap();
        let picture = taken.picture;
        let read = PictureRead { picture, saturated_ratio: 0.0, bits: 8, notes: Vec::new() };
        let found = calibrate_delay(&read, &pattern, &known.machine, None).unwrap();
        known.machine = found.applied(&known.machine, Apply::Laser).0;
    }

    /// Marks a grid on a plate that lies on a printed sheet, photographs both, and takes the
    /// field's correction from the picture.
    pub fn tell_field(&self, known: &mut Known) {
        let machine = &known.machine;
        let options = GridOptions {
            n_side: 17,
            field_mm: 140.0,
            style: MarkStyle::Cross,
            size_mm: None,
            process: SheetProcess::of(machine),
        };
        let sheet = fiducials::around(grid::sheet(&options, machine).unwrap()).unwrap();
        let camera = self.camera(known);
        let taken = photograph(&sheet.pattern, &[], machine, &camera, &mut |_| {}).unwrap();
        // What a caliper reads on the sheet is all that is measured by hand.
        let options = PictureOptions {
            sheet_mm: taken.caliper_mm,
            placement: Placement::Sheet,
            ..PictureOptions::default()
        };
        let seen = find_field(&taken.picture, &sheet.pattern, &options).unwrap();
        let picture = FieldPicture {
            path: "sheet".into(),
            picture: taken.picture,
            seen,
            warnings: Vec::new(),
        };
        let points: Vec<_> = points(&[picture], 1).into_iter().map(|(_, point)| point).collect();
        let found = calibrate_field(machine, &points, &FieldOptions::default()).unwrap();
        known.table = Some(found.table);
    }

    /// Marks a square and lines with what is known.
    pub fn mark(&self, known: &Known, store: &AtlasStore) -> Quality {
        let marked = |path: &str, in_field: bool| {
            let text = format!(
                r#"<svg xmlns="http://www.w3.org/2000/svg" width="120mm" height="120mm"
                    viewBox="-60 -60 120 120" fill="none" stroke="black"><path d="{path}"/></svg>"#
            );
            let recipe = Recipe::default();
            let options = svg::SvgOptions::default();
            let job = svg::read(text.as_bytes(), &recipe, &options).unwrap().value;
            let options = MarkOptions {
                speed_mm_s: Some(2000.0),
                atlas_store: store.clone(),
                mismatch: Mismatch { late_ns: self.late_ns(&known.machine), ..Mismatch::default() },
                tolerance_mm: 0.005,
                head: in_field.then(|| self.head.clone()),
                table: known.table.clone().filter(|_| in_field),
                ..MarkOptions::default()
            };
            mark(&job, &known.machine, &recipe, &options, &mut |_| {}).unwrap().score
        };
        let square = marked("M-50 -50 H50 V50 H-50 Z", true);
        let lines = marked("M-3 -2 H3 M3 0 H-3 M-3 2 H3 M-5 -3 V3 M5 3 V-3", false);
        Quality { contour_um: square.contour_error_um.max, ends_um: lines.end_error_um.max }
    }
}
