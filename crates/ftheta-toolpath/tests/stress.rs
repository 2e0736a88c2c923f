//! x
#![allow(clippy::unwrap_used, reason = "x")]
use ftheta_model::job::*; use ftheta_model::recipe::*; use ftheta_toolpath::lay::*; use kurbo::{Circle, Point, Shape as _, Rect, BezPath};
#[test]
fn nested() {
    let mut shapes = vec![Shape{source:"#f".into(),path:Rect::new(-59.,-59.,59.,59.).to_path(0.1),paint:Paint::Stroke,pen_index:0}];
    for i in 0..140 { for j in 0..140 { let c=Point::new(i as f64*0.8-56.0+0.1*(((i*7+j*13)%5) as f64), j as f64*0.8-56.0);
        let mut p=Circle::new(c,0.3).to_path(1e-3); p.extend(Circle::new(c,0.15).to_path(1e-3).iter());
        shapes.push(Shape{source:"#o".into(),path:p,paint:Paint::Stroke,pen_index:0}); } }
    let job=Job{pens:vec![Pen::default()],layers:vec![Layer{name:String::new(),shapes}],page_mm:[120.,120.]};
    for order in [Order::Keep, Order::Shortest] { let t=std::time::Instant::now(); let l=lay(&job,&LayOptions{order,..Default::default()}).unwrap().value; println!("{order:?} {} marks jump {:.1} mm in {:?}",l.marks.len(),l.jump_length_mm(),t.elapsed()); }
    // hatch of a big area with many holes
    let mut p: BezPath=Rect::new(-50.,-50.,50.,50.).to_path(0.1);
    for i in 0..60 { for j in 0..60 { p.extend(Circle::new(Point::new(i as f64*1.6-48.,j as f64*1.6-48.),0.5).to_path(1e-3).iter()); } }
    let job=Job{pens:vec![Pen{hatch:Some(Hatch{spacing_mm:0.05,angle_deg:37.0,outline:true}),..Pen::default()}],layers:vec![Layer{name:String::new(),shapes:vec![Shape{source:"#h".into(),path:p,paint:Paint::Fill(FillRule::EvenOdd),pen_index:0}]}],page_mm:[120.,120.]};
    for order in [Order::Keep, Order::Shortest] { let t=std::time::Instant::now(); let l=lay(&job,&LayOptions{order,..Default::default()}).unwrap().value; println!("hatch {order:?} {} marks jump {:.1} mm in {:?}",l.marks.len(),l.jump_length_mm(),t.elapsed()); }
    // random segments: quality
    let mut x=1u32; let mut r=||{x^=x<<13;x^=x>>17;x^=x<<5; f64::from(x)/f64::from(u32::MAX)};
    let shapes:Vec<Shape>=(0..100_000).map(|_|{let a=Point::new(r()*100.-50.,r()*100.-50.);let mut p=BezPath::new();p.move_to(a);p.line_to((a.x+1e-4,a.y));Shape{source:"#p".into(),path:p,paint:Paint::Stroke,pen_index:0}}).collect();
    let job=Job{pens:vec![Pen::default()],layers:vec![Layer{name:String::new(),shapes}],page_mm:[120.,120.]};
    for b in [0u64,20_000_000,100_000_000,1_000_000_000] { let t=std::time::Instant::now(); let l=lay(&job,&LayOptions{moves_budget:b,..Default::default()}).unwrap().value; println!("budget {b}: jump {:.1} mm, random optimum about {:.1}, in {:?}",l.jump_length_mm(),0.7124*(100_000f64*10_000.).sqrt(),t.elapsed()); }
}
