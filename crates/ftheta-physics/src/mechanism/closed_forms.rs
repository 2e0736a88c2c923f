//! Elements against closed forms: a cantilever's bending and a free plate.

use super::solve::{Entries, Row};
use super::{Material, Part, Segment, beam, plate};
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};
use std::f64::consts::PI;

const STEEL: Material = Material { young_pa: 210e9, poisson: 0.3, density_kg_m3: 7850.0 };

/// Angular frequencies of the freedoms that are kept, slowest first, rad/s.
fn frequencies(n: usize, stiffness: &Entries, mass: &Entries, keep: &[usize]) -> Vec<f64> {
    let part = |entries: &Entries| {
        let dense = entries.to_dense(n);
        DMatrix::from_fn(keep.len(), keep.len(), |i, j| dense[(keep[i], keep[j])])
    };
    let lower = Cholesky::new(part(mass)).unwrap().unpack();
    let half = lower.solve_lower_triangular(&part(stiffness)).unwrap();
    let whole = lower.solve_lower_triangular(&half.transpose()).unwrap();
    let mut squares: Vec<f64> = SymmetricEigen::new((&whole + whole.transpose()) * 0.5)
        .eigenvalues
        .iter()
        .copied()
        .collect();
    squares.sort_by(f64::total_cmp);
    squares.into_iter().map(|square| square.max(0.0).sqrt()).collect()
}

fn cantilever(segment: &Segment, n_elements: usize) -> Vec<f64> {
    let length = segment.length_m / n_elements as f64;
    let (mut stiffness, mut mass) = (Entries::default(), Entries::default());
    for node in 0..n_elements {
        let freedoms: Vec<Row> = (6 * node..6 * node + 12).map(|i| vec![(i, 1.0)]).collect();
        let [k, m] = beam::element(segment, length);
        stiffness.add(&k, &freedoms);
        mass.add(&m, &freedoms);
    }
    let n = 6 * (n_elements + 1);
    frequencies(n, &stiffness, &mass, &(6..n).collect::<Vec<_>>())
}

/// Slender, so that shear and rotary inertia do not count: (λ/l)²·sqrt(EI/ρA), each twice.
#[test]
fn cantilever_bends_at_the_closed_forms() {
    let (l, d) = (1.0, 0.004);
    let segment =
        Segment { part: Part::Shaft, length_m: l, diameter_m: d, bore_m: 0.0, material: STEEL };
    let found = cantilever(&segment, 12);
    let scale = (STEEL.young_pa * d * d / 16.0 / STEEL.density_kg_m3).sqrt();
    for (index, lambda) in [1.875_104_07, 4.694_091_13, 7.854_757_44].into_iter().enumerate() {
        let expected = (lambda / l) * (lambda / l) * scale;
        for twin in [2 * index, 2 * index + 1] {
            assert!((found[twin] / expected - 1.0).abs() < 3e-4, "{} {expected}", found[twin]);
        }
    }
}

/// Angular frequencies of Timoshenko's cantilever from its characteristic equation, rad/s.
///
/// Source: Huang 1961, clamped-free.
fn timoshenko(l: f64, d: f64, shear_share: f64, n: usize) -> Vec<f64> {
    let (area, second) = (PI / 4.0 * d * d, PI / 64.0 * d.powi(4));
    let bend = STEEL.young_pa * second;
    let r2 = second / (area * l * l);
    let s2 = bend / (shear_share * STEEL.shear_pa() * area * l * l);
    let scale = (bend / (STEEL.density_kg_m3 * area * l.powi(4))).sqrt();
    let residual = |b: f64| {
        let root = ((r2 - s2).powi(2) + 4.0 / (b * b)).sqrt();
        let alpha = ((root - r2 - s2) / 2.0).sqrt();
        let beta = ((root + r2 + s2) / 2.0).sqrt();
        2.0 + (b * b * (r2 - s2).powi(2) + 2.0) * (b * alpha).cosh() * (b * beta).cos()
            - b * (r2 + s2) / (1.0 - b * b * r2 * s2).sqrt() * (b * alpha).sinh() * (b * beta).sin()
    };
    let mut found = Vec::new();
    let (mut low, step) = (0.1, 0.01);
    while found.len() < n {
        if residual(low) * residual(low + step) < 0.0 {
            let (mut a, mut b) = (low, low + step);
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if residual(a) * residual(middle) <= 0.0 { b = middle } else { a = middle }
            }
            found.push(a * scale);
        }
        low += step;
    }
    found
}

/// Thick enough that shear and rotary inertia lower the second frequency by a tenth and more.
#[test]
fn thick_cantilever_bends_as_timoshenko_says() {
    let (l, d) = (0.05, 0.012);
    let segment =
        Segment { part: Part::Shaft, length_m: l, diameter_m: d, bore_m: 0.0, material: STEEL };
    let fine = cantilever(&segment, 24);
    let nu = STEEL.poisson;
    let expected = timoshenko(l, d, 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu), 2);
    let euler = (4.694_091_13_f64 / l).powi(2)
        * (STEEL.young_pa * d * d / 16.0 / STEEL.density_kg_m3).sqrt();
    assert!(expected[1] < 0.9 * euler);
    assert!((fine[0] / expected[0] - 1.0).abs() < 1e-3, "{} {}", fine[0], expected[0]);
    let nearest = fine.iter().map(|f| (f / expected[1] - 1.0).abs()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-3, "{} {nearest}", expected[1]);
    // Torsion and stretching of the same bar, c·π/2l.
    for modulus in [STEEL.young_pa, STEEL.shear_pa()] {
        let expected = (modulus / STEEL.density_kg_m3).sqrt() * PI / (2.0 * l);
        let nearest = fine.iter().map(|f| (f / expected - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 5e-4, "{expected} {nearest}");
    }
}

/// Frequency parameters ω·a²·sqrt(ρh/D) of a thin free plate, n × n elements, skewed by `skew` · a.
fn free_plate(n: usize, skew: f64) -> Vec<f64> {
    let (a, h) = (1.0, 0.005);
    let node = |row: usize, column: usize| row * (n + 1) + column;
    let place = |row: usize, column: usize| {
        let (s, t) = (row as f64 / n as f64, column as f64 / n as f64);
        // Inner nodes are moved, so that elements are not squares.
        let bump = skew * (PI * s).sin() * (PI * t).sin();
        [a * (s + bump), a * (t - 0.5 * bump)]
    };
    let (mut stiffness, mut mass) = (Entries::default(), Entries::default());
    for row in 0..n {
        for column in 0..n {
            let corners =
                [(row, column), (row + 1, column), (row + 1, column + 1), (row, column + 1)];
            let [k, m] = plate::element(&corners.map(|(r, c)| place(r, c)), h, &STEEL);
            let freedoms: Vec<Row> = corners
                .iter()
                .flat_map(|&(r, c)| (0..5).map(move |i| vec![(5 * node(r, c) + i, 1.0)]))
                .collect();
            stiffness.add(&k, &freedoms);
            mass.add(&m, &freedoms);
        }
    }
    let n_freedoms = 5 * (n + 1) * (n + 1);
    let bending: Vec<usize> = (0..n_freedoms).filter(|i| i % 5 >= 2).collect();
    let rigidity = STEEL.young_pa * h * h / (12.0 * (1.0 - STEEL.poisson * STEEL.poisson));
    let scale = (STEEL.density_kg_m3 / rigidity).sqrt() * a * a;
    frequencies(n_freedoms, &stiffness, &mass, &bending).into_iter().map(|w| w * scale).collect()
}

/// Completely free square plate, Poisson's ratio 0.3: Leissa 1973, whose Ritz series gives upper
/// bounds, and the converged values of later authors (Gorman 1978; Liew and others 1993).
const PUBLISHED: [(f64, f64); 5] =
    [(13.489, 13.468), (19.789, 19.596), (24.432, 24.271), (35.024, 34.801), (35.024, 34.801)];

#[test]
fn free_plate_vibrates_as_published() {
    let (coarse, fine) = (free_plate(6, 0.0), free_plate(12, 0.0));
    let rigid = fine[2] / PUBLISHED[0].1;
    assert!(rigid < 1e-3, "three rigid motions: {rigid}");
    for (index, (bound, converged)) in PUBLISHED.into_iter().enumerate() {
        let found = fine[3 + index];
        assert!((found / bound - 1.0).abs() < 0.03, "{found} {bound}");
        // The error falls with the square of the element.
        let limit = (4.0 * found - coarse[3 + index]) / 3.0;
        assert!(limit < bound, "{limit} {bound}");
        assert!((limit / converged - 1.0).abs() < 1e-3, "{limit} {converged}");
    }
}

#[test]
fn skewed_elements_do_not_lock() {
    for (found, (_, expected)) in free_plate(10, 0.08)[3..6].iter().zip(PUBLISHED) {
        assert!((found / expected - 1.0).abs() < 0.04, "{found} {expected}");
    }
}
