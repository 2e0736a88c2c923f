#![allow(clippy::unwrap_used, missing_docs, reason = "x")]
#[path = "../tests/hidden/mod.rs"]
mod hidden;
use hidden::Setup;
use ftheta::calibrate::calibrate::calibrate;
fn main() {
    let n: u64 = std::env::args().nth(1).unwrap().parse().unwrap();
    for (k, noise, poly) in [(3,10.0,true),(3,50.0,true),(3,10.0,false),(5,10.0,false),(5,50.0,false),(9,10.0,false),(9,50.0,false),(17,2.0,false)] {
        let setup = Setup::new(k, noise, poly);
        let (mut found, mut wrong, mut rms, mut clean) = (0, 0, 0.0, 0.0);
        for s in 3000..3000 + n {
            let head = setup.head(s);
            let mut marks = setup.marks(&head, s);
            let c = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
            wrong += c.outliers.len();
            clean += setup.judge_um(&head, &c).0 / n as f64;
            let bad = (s as usize * 7919) % marks.len();
            let angle = s as f64;
            marks[bad].measured.x_mm += 1.2 * angle.cos();
            marks[bad].measured.y_mm += 1.2 * angle.sin();
            let c = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
            found += usize::from(c.outliers.contains(&bad));
            wrong += c.outliers.iter().filter(|&&o| o != bad).count();
            rms += setup.judge_um(&head, &c).0 / n as f64;
        }
        println!("{k} {noise} {poly}: found {found} of {n}, falsely {wrong}; rms {clean:.1} {rms:.1}");
    }
    let setup = Setup::new(17, 10.0, false);
    for k in [17, 65] {
        let setup = Setup { n_side: k, ..setup };
        let head = setup.head(1);
        let marks = setup.marks(&head, 1);
        let t = std::time::Instant::now();
        let c = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
        println!("{k}: {:.2} s, {:?}", t.elapsed().as_secs_f64(), setup.judge_um(&head, &c));
    }
}
