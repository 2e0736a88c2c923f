//! A photograph with what was found in it drawn over.

use crate::text::{escaped, put};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use ftheta_model::picture::PixelPoint;

/// A part of a photograph, and what was found there.
#[derive(Clone, Debug)]
pub struct PictureView<'a> {
    /// The part as a JPEG, perhaps smaller than it was taken.
    pub jpeg: &'a [u8],
    /// Upper left corner, width and height of the part, px of the photograph.
    pub region_px: [f64; 4],
    /// What was found, in px of the photograph.
    pub sights: &'a [Sight],
    /// Size of the signs that are drawn, by the part's width.
    pub sign: f64,
}

/// Something in a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Sight {
    /// What became of it.
    pub kind: SightKind,
    /// Where it is, or its corners.
    pub places: Vec<PixelPoint>,
    /// What there is to say of it.
    pub label: String,
}

/// What became of something in a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SightKind {
    /// It was used.
    Used,
    /// It was left out.
    LeftOut,
    /// It is none of what was looked for.
    Extra,
}

impl SightKind {
    fn color(self) -> &'static str {
        match self {
            Self::Used => "#1f9d55",
            Self::LeftOut => "#d7261e",
            Self::Extra => "#e08a00",
        }
    }
}

/// The photograph as an `svg` element.
pub fn svg(view: &PictureView<'_>) -> String {
    let [left, top, width, height] = view.region_px;
    let picture = BASE64_STANDARD.encode(view.jpeg);
    let mut out = format!(
        "<svg class=photo viewBox='{left:.1} {top:.1} {width:.1} {height:.1}' role=img>\
         <image x='{left:.1}' y='{top:.1}' width='{width:.1}' height='{height:.1}' \
         preserveAspectRatio='none' href='data:image/jpeg;base64,{picture}'/>"
    );
    let radius = view.sign * width;
    let stroke = 0.3 * radius;
    for Sight { kind, places, label } in view.sights {
        let color = kind.color();
        let inside = |p: &PixelPoint| {
            (left..left + width).contains(&p.x_px) && (top..top + height).contains(&p.y_px)
        };
        if !places.iter().any(inside) {
            continue;
        }
        put(&mut out, format_args!("<g stroke='{color}' stroke-width='{stroke:.2}' fill='none'>"));
        if !label.is_empty() {
            put(&mut out, format_args!("<title>{}</title>", escaped(label)));
        }
        match places[..] {
            [PixelPoint { x_px, y_px }] if *kind == SightKind::Used => {
                let [l, r] = [x_px - radius, x_px + radius];
                let [t, b] = [y_px - radius, y_px + radius];
                put(
                    &mut out,
                    format_args!("<path d='M{l:.2} {y_px:.2}H{r:.2}M{x_px:.2} {t:.2}V{b:.2}'/>"),
                );
            }
            [PixelPoint { x_px, y_px }] => {
                let r = 1.5 * radius;
                put(&mut out, format_args!("<circle cx='{x_px:.2}' cy='{y_px:.2}' r='{r:.2}'/>"));
            }
            _ => {
                out.push_str("<path d='");
                for (index, PixelPoint { x_px, y_px }) in places.iter().enumerate() {
                    let letter = if index == 0 { 'M' } else { 'L' };
                    put(&mut out, format_args!("{letter}{x_px:.2} {y_px:.2}"));
                }
                out.push_str("Z'/>");
            }
        }
        out.push_str("</g>");
    }
    out.push_str("</svg>");
    out
}

/// What the colours mean.
pub fn key(words: [(SightKind, &str); 3]) -> String {
    let mut out = String::from("<div class=key>");
    for (kind, word) in words {
        let (color, word) = (kind.color(), escaped(word));
        put(&mut out, format_args!("<span><i style='border-color:{color}'></i>{word}</span>"));
    }
    out.push_str("</div>");
    out
}
