//! Size of the page and units.

use crate::checks::{check, check_with, job_of, path_text};
use expect_test::expect;
use ftheta_formats::svg::SvgOptions;
use ftheta_model::recipe::Recipe;
use kurbo::{Point, Shape};

#[test]
fn millimetres_come_out_exactly() {
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="64mm"
            viewBox="0 0 100 64">
            <path id="p" d="M0 0L100 64M10 10h20v-5l-3-4" fill="none" stroke="#f00"/>
        </svg>"##,
        expect![[r#"
            page 100 x 64 mm
            layer ""
              stroke #ff0000 #p: M-50,32 L50,-32 M-40,22 L-20,22 L-20,27 L-23,31
        "#]],
    );
}

#[test]
fn units() {
    for (size, side_mm) in [
        ("50mm", 50.0),
        ("5cm", 50.0),
        ("2in", 50.8),
        ("144pt", 50.8),
        ("12pc", 50.8),
        ("192px", 50.8),
        ("192", 50.8),
        ("2IN", 50.8),
    ] {
        let drawing = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='{size}' height='{size}'>\
             <line x1='0' y1='0' x2='100%' y2='{size}' stroke='red'/></svg>"
        );
        let job = job_of(&drawing);
        let bounds = job.layers[0].shapes[0].path.bounding_box();
        for value in [job.page_mm[0], job.page_mm[1], bounds.width(), bounds.height()] {
            assert!((value - side_mm).abs() < 1e-12, "{size}: {value}");
        }
        assert!(bounds.center().distance(Point::ORIGIN) < 1e-12);
    }
}

#[test]
fn page_from_view_box_or_content() {
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-48 -48 96 192">
            <path id="p" d="M-48-48L48 144" stroke="#000"/></svg>"##,
        expect![[r#"
            page 25.4 x 50.8 mm
            layer ""
              stroke #000000 #p: M-12.7,25.4 L12.7,-25.4
        "#]],
    );
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg">
            <path id="p" d="M96 96h96v192" fill="none" stroke="#000"/></svg>"##,
        expect![[r#"
            page 25.4 x 50.8 mm
            layer ""
              stroke #000000 #p: M-12.7,25.4 L12.7,25.4 L12.7,-25.4
            warning: <svg>: states no size, so its content in px is taken as the page
        "#]],
    );
    let options = SvgOptions { fit_mm: Some(30.0), ..SvgOptions::default() };
    check_with(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="100%" height="100%" viewBox="0 0 7 14">
            <path id="p" d="M0 0L7 14" stroke="#000"/></svg>"##,
        &Recipe::default(),
        &options,
        expect![[r#"
            page 15 x 30 mm
            layer ""
              stroke #000000 #p: M-7.5,15 L7.5,-15
        "#]],
    );
}

#[test]
fn aspect_ratio() {
    for aspect in ["xMidYMid meet", "xMinYMax meet", "xMaxYMin slice", "none"] {
        let drawing = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='10mm' \
             viewBox='0 0 5 5' preserveAspectRatio='{aspect}'>\
             <path id='p' d='M0 0L5 5' stroke='red'/></svg>"
        );
        let expected = match aspect {
            "xMidYMid meet" => "M-5,5 L5,-5",
            "xMinYMax meet" => "M-10,5 L0,-5",
            "xMaxYMin slice" => "M-10,5 L10,-15",
            _ => "M-10,5 L10,-5",
        };
        let job = job_of(&drawing);
        assert_eq!(path_text(&job.layers[0].shapes[0].path), expected, "{aspect}");
    }
}
