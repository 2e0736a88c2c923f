//! What a printer put on the sheet: a little too large or too small, and differently along x and y.

use ftheta_model::tag;
use kurbo::{Affine, Point, Rect, Vec2};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// Width of printed lines and length of the bars at their ends, mm.
const LINE_MM: f64 = 0.25;
const BAR_MM: f64 = 3.0;

/// A printed rectangle, and by how much it changes the brightness of what lies below.
#[derive(Clone, Copy, Debug)]
pub struct Print {
    /// In its own frame, mm.
    pub rect: Rect,
    /// From that frame to the plate.
    pub placed: Affine,
    /// The way back.
    pub back: Affine,
    /// Change of brightness.
    pub change: f64,
}

/// A printer, its errors, and how its sheet lies on the plate.
#[derive(Debug)]
pub struct Printer {
    /// Printed over true length, along x and y.
    pub scale: [f64; 2],
    /// How far a sign is off on top of that, mm rms along each axis.
    pub noise_mm: f64,
    /// Where the sheet lies: its centre and turn in the field.
    pub lies: Affine,
    /// Brightness of the plate, of white and of black ink.
    pub shades: [f64; 3],
    random: Xoshiro256PlusPlus,
}

impl Printer {
    /// A printer whose errors come from a seed: 0.2 to 0.4 % along each axis.
    pub fn new(seed: u64, lies: Affine, shades: [f64; 3]) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x7072_696e_7465_7200);
        let mut drawn = || {
            let unit = uniform(&mut random);
            (2e-3 + 2e-3 * uniform(&mut random)).copysign(unit - 0.5)
        };
        let scale = [1.0 + drawn(), 1.0 + drawn()];
        Self { scale, noise_mm: 0.0, lies, shades, random }
    }

    /// Where a place of the sheet's drawing lies in the field.
    pub fn place(&self, place: Point) -> Point {
        self.lies * Point::new(self.scale[0] * place.x, self.scale[1] * place.y)
    }

    /// A normal number from the printer's stream.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// A tag and its white margin, and where its centre is; `None` if there is no such tag.
    ///
    /// * `size_mm`: side of its black square
    pub fn tag(
        &mut self,
        number: usize,
        centre: Point,
        size_mm: f64,
    ) -> Option<(Vec<Print>, Point)> {
        let cells = tag::cells(number)?;
        let noise = Vec2::new(self.normal(), self.normal()) * self.noise_mm;
        let placed = self.lies
            * Affine::translate(noise)
            * Affine::scale_non_uniform(self.scale[0], self.scale[1])
            * Affine::translate(centre.to_vec2());
        let [plate, white, black] = self.shades;
        let cell_mm = size_mm / tag::N_CELLS as f64;
        let half_mm = 0.5 * size_mm;
        let mut prints = Vec::new();
        let mut put = |rect: Rect, change: f64| {
            prints.push(Print { rect, placed, back: placed.inverse(), change });
        };
        let square = Rect::new(-half_mm, -half_mm, half_mm, half_mm);
        put(square.inflate(cell_mm, cell_mm), white - plate);
        put(square, black - white);
        for (row, cells) in cells.iter().enumerate() {
            let y = half_mm - cell_mm * (row + 1) as f64;
            for (column, _) in cells.iter().enumerate().filter(|(_, white)| **white) {
                let x = cell_mm * column as f64 - half_mm;
                put(Rect::new(x, y, x + cell_mm, y + cell_mm), white - black);
            }
        }
        Some((prints, placed * Point::ZERO))
    }

    /// A line with a bar across each end; its length is from bar to bar.
    pub fn line(&self, from: Point, to: Point) -> Vec<Print> {
        let (from, to) = (self.place(from), self.place(to));
        let placed = Affine::translate(from.to_vec2()) * Affine::rotate((to - from).angle());
        let (length_mm, half_mm) = (from.distance(to), 0.5 * LINE_MM);
        let bar = |x: f64| Rect::new(x - half_mm, -0.5 * BAR_MM, x + half_mm, 0.5 * BAR_MM);
        let middle = Rect::new(half_mm, -half_mm, (length_mm - half_mm).max(half_mm), half_mm);
        let [plate, white, black] = self.shades;
        let change = if plate > 0.5 { black - plate } else { white - plate };
        [bar(0.0), middle, bar(length_mm)]
            .map(|rect| Print { rect, placed, back: placed.inverse(), change })
            .to_vec()
    }
}

/// A number from [0, 1).
pub(super) fn uniform(random: &mut Xoshiro256PlusPlus) -> f64 {
    use rand_xoshiro::rand_core::Rng as _;
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

impl Print {
    /// How much it changes the brightness of a small square around a place.
    ///
    /// * `side_mm`: of the square, taken along the print's own axes
    pub(super) fn change_at(&self, place: Point, side_mm: f64) -> f64 {
        let place = self.back * place;
        let half_mm = 0.5 * side_mm;
        let shared = |at: f64, low: f64, high: f64| {
            ((at + half_mm).min(high) - (at - half_mm).max(low)).max(0.0) / side_mm
        };
        self.change
            * shared(place.x, self.rect.x0, self.rect.x1)
            * shared(place.y, self.rect.y0, self.rect.y1)
    }
}
