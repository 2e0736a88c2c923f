//! Parts of photographs for reports: smaller copies, and what was found as signs over them.

use ftheta_formats::picture_file::write_jpeg;
use ftheta_model::picture::Picture;
use ftheta_report::picture_view::{PictureView, Sight};

/// Widest copy, px, and its quality.
const WIDTH_MAX: usize = 1400;
const QUALITY: u8 = 82;
/// Signs that are drawn in the whole picture, and in an enlarged part, by its width.
const SIGN_WHOLE: f64 = 0.004;
const SIGN_PART: f64 = 0.012;

/// A part of a photograph as it goes into a report.
#[derive(Clone, Debug)]
pub struct Part {
    caption: String,
    jpeg: Vec<u8>,
    region_px: [f64; 4],
    sign: f64,
}

impl Part {
    /// The whole photograph, made smaller where it is large.
    pub fn whole(caption: &str, picture: &Picture) -> Option<Self> {
        let size = [picture.width(), picture.height()];
        Self::new(caption, picture, [0, 0, size[0], size[1]], SIGN_WHOLE)
    }

    /// An enlarged part: upper left corner, width and height, px; cut at the border.
    pub fn enlarged(caption: &str, picture: &Picture, region: [usize; 4]) -> Option<Self> {
        Self::new(caption, picture, region, SIGN_PART)
    }

    fn new(
        caption: &str,
        picture: &Picture,
        [left, top, width, height]: [usize; 4],
        sign: f64,
    ) -> Option<Self> {
        let (left, top) = (left.min(picture.width() - 1), top.min(picture.height() - 1));
        let (width, height) =
            (width.min(picture.width() - left), height.min(picture.height() - top));
        let by = width.max(height / 2).div_ceil(WIDTH_MAX).max(1);
        let (columns, rows) = ((width / by).max(1), (height / by).max(1));
        let by = by.min(width).min(height);
        let mut values = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let mut sum = 0.0;
                for y in 0..by {
                    let from = left + column * by;
                    sum += picture.row(top + row * by + y)[from..from + by].iter().sum::<f32>();
                }
                values.push(sum / (by * by) as f32);
            }
        }
        let copy = Picture::new(columns, rows, values).ok()?;
        let jpeg = write_jpeg(&copy, QUALITY)?;
        let region = [left, top, columns * by, rows * by].map(|px| px as f64);
        // Pixels reach half a pixel beyond their centres.
        let region_px = [region[0] - 0.5, region[1] - 0.5, region[2], region[3]];
        Some(Self { caption: caption.into(), jpeg, region_px, sign })
    }

    /// The part with its signs.
    pub fn view<'a>(&'a self, sights: &'a [Sight]) -> (String, PictureView<'a>) {
        let Self { caption, jpeg, region_px, sign } = self;
        let view = PictureView { jpeg, region_px: *region_px, sights, sign: *sign };
        (caption.clone(), view)
    }
}
