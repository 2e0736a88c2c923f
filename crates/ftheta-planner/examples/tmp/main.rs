use ftheta_model::machine::*;
use ftheta_planner::jump::*;
fn main() {
    let scanner: Scanner = {
        let t = std::fs::read_to_string(std::env::args().nth(1).unwrap()).unwrap();
        ftheta_formats::machine::read("m", &t).unwrap().scanner
    };
    let v: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let reserve: f64 = std::env::args().nth(3).unwrap().parse().unwrap();
    let robust: f64 = std::env::args().nth(4).unwrap().parse().unwrap();
    let model = if robust < 0.0 {
        Model::Held { epsilon_rad: -robust }
    } else if robust > 0.0 {
        Model::Robust { epsilon_rad: robust }
    } else {
        Model::Flexible
    };
    let axis = AxisOptions {
        model,
        tick_s: 1e-5,
        voltage_reserve: reserve,
        current_bound: CurrentBound::Always,
    };
    let tr = Transitions::new(&scanner, axis).unwrap();
    let mut total = (0, 0);
    for l in std::fs::read_to_string("/tmp/routes.txt").unwrap().lines() {
        let n: Vec<f64> = l.split_whitespace().map(|x| x.parse().unwrap()).collect();
        let r = |a: usize| Route {
            from_rad: n[a] / 320.0,
            to_rad: n[4 + a] / 320.0,
            from_rad_s: n[2 + a] * v / 320.0,
            to_rad_s: n[6 + a] * v / 320.0,
        };
        let routes = [r(0), r(1)];
        let e =
            fewest_ticks_between(&scanner, axis, &routes).unwrap().map(|v| v[0].len()).unwrap_or(0);
        let f = tr.plan_both(&routes).unwrap().map(|[a, _]| a.n_ticks()).unwrap_or(0);
        print!("{e}/{f} ");
        total.0 += e;
        total.1 += f;
    }
    println!("\nexact {} fans {}", total.0, total.1);
}
