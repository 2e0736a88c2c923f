//! Energy along a mark's curve, and its mean over a sliding window.

use crate::contour::Contour;

/// Energy in equal bins of arc length.
#[derive(Debug)]
pub struct LineDose {
    energy_j: Vec<f64>,
    bin_mm: f64,
    n_window: usize,
    length_mm: f64,
    closed: bool,
}

impl LineDose {
    /// Bins that divide the window; none where the mark is shorter than the window.
    ///
    /// * `bin_max_mm`: widest bin, mm
    pub fn new(contour: &Contour, window_mm: f64, bin_max_mm: f64) -> Self {
        let length_mm = contour.length_mm();
        let n_window = (window_mm / bin_max_mm).ceil().max(1.0);
        let bin_mm = window_mm / n_window;
        let n_bins = match length_mm >= window_mm {
            true => (length_mm / bin_mm).ceil() as usize,
            false => 0,
        };
        Self {
            energy_j: vec![0.0; n_bins],
            bin_mm,
            n_window: n_window as usize,
            length_mm,
            closed: contour.is_closed(),
        }
    }

    /// Spreads energy evenly between two arc positions, mm.
    pub fn add(&mut self, a_mm: f64, b_mm: f64, energy_j: f64) {
        if self.energy_j.is_empty() {
            return;
        }
        let (lo, hi) = (a_mm.min(b_mm), a_mm.max(b_mm));
        if self.closed && (lo < 0.0 || hi > self.length_mm) {
            self.add_round(lo, hi, energy_j);
            return;
        }
        let last = self.energy_j.len() - 1;
        let bin = |at_mm: f64| ((at_mm / self.bin_mm) as usize).min(last);
        let (first, end) = (bin(lo), bin(hi));
        if first == end {
            self.energy_j[first] += energy_j;
            return;
        }
        let density_j_mm = energy_j / (hi - lo);
        let edge_mm = |bin: usize| bin as f64 * self.bin_mm;
        let (head_mm, tail_mm) = (edge_mm(first + 1) - lo, hi - edge_mm(end));
        self.energy_j[first] += density_j_mm * head_mm;
        self.energy_j[end] += density_j_mm * tail_mm;
        let whole_j = density_j_mm * self.bin_mm;
        for energy in &mut self.energy_j[first + 1..end] {
            *energy += whole_j;
        }
    }

    /// The same for a stretch that passes the seam of a closed curve.
    fn add_round(&mut self, lo: f64, hi: f64, energy_j: f64) {
        let seam_mm = if lo < 0.0 { 0.0 } else { self.length_mm };
        if lo < seam_mm && seam_mm < hi {
            let share = (seam_mm - lo) / (hi - lo);
            self.add(lo, seam_mm, share * energy_j);
            self.add(seam_mm, hi, (1.0 - share) * energy_j);
            return;
        }
        let turns_mm = (0.5 * (lo + hi) / self.length_mm).floor() * self.length_mm;
        let within = |at_mm: f64| (at_mm - turns_mm).clamp(0.0, self.length_mm);
        self.add(within(lo), within(hi), energy_j);
    }

    /// Mean line energy of every window wholly inside the mark, J/mm, one per bin edge.
    pub fn windows_j_mm(&self) -> impl Iterator<Item = f64> {
        let window_mm = self.n_window as f64 * self.bin_mm;
        let n_whole = (self.length_mm / self.bin_mm * (1.0 + 1e-12)) as usize;
        let n_bins = n_whole.min(self.energy_j.len());
        let mut inside_j = 0.0;
        (0..n_bins).filter_map(move |end| {
            inside_j += self.energy_j[end];
            let start = (end + 1).checked_sub(self.n_window)?;
            let mean_j_mm = inside_j / window_mm;
            inside_j -= self.energy_j[start];
            Some(mean_j_mm.max(0.0))
        })
    }
}
