//! Pictures of one pattern, written by Pillow, OpenCV and pypng.

use super::*;
use proptest::prelude::*;

const WIDTH: usize = 23;
const HEIGHT: usize = 17;

macro_rules! fixture {
    ($name:literal) => {
        ($name, include_bytes!(concat!("fixtures/", $name)).as_slice())
    };
}

const GREY: [(&str, &[u8]); 5] = [
    fixture!("grey.jpg"),
    fixture!("interlaced.png"),
    fixture!("lzw.tif"),
    fixture!("packbits.tif"),
    fixture!("grey-16.png"),
];
const COLOUR: [(&str, &[u8]); 4] = [
    fixture!("progressive.jpg"),
    fixture!("turned.jpg"),
    fixture!("palette.png"),
    fixture!("deflate.tif"),
];

fn slopes(x: usize, y: usize) -> [f32; 2] {
    [x as f32 / (WIDTH - 1) as f32, y as f32 / (HEIGHT - 1) as f32]
}

fn grey(x: usize, y: usize) -> f32 {
    let [u, v] = slopes(x, y);
    0.5 * (u + v)
}

fn colour(x: usize, y: usize) -> f32 {
    let [u, v] = slopes(x, y);
    WEIGHTS[0] * u + WEIGHTS[1] * v + WEIGHTS[2] * 128.0 / 255.0
}

fn greatest_error(picture: &Picture, expected: impl Fn(usize, usize) -> f32) -> f32 {
    assert_eq!([picture.width(), picture.height()], [WIDTH, HEIGHT]);
    let places = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    places.map(|(x, y)| (picture.row(y)[x] - expected(x, y)).abs()).fold(0.0, f32::max)
}

#[test]
fn pictures_are_what_was_drawn() {
    for (name, bytes) in GREY {
        let read = read(bytes).unwrap();
        let error = greatest_error(&read.picture, grey);
        let allowed = if name.ends_with("jpg") { 0.02 } else { 0.003 };
        assert!(error < allowed, "{name}: {error}");
        assert_eq!(read.bits, if name == "grey-16.png" { 16 } else { 8 }, "{name}");
    }
    for (name, bytes) in COLOUR {
        let read = read(bytes).unwrap();
        let error = greatest_error(&read.picture, colour);
        let allowed = if name == "deflate.tif" { 0.003 } else { 0.06 };
        assert!(error < allowed, "{name}: {error}");
        assert_eq!(read.notes.len(), usize::from(name == "turned.jpg"), "{name}");
    }
    let (_, alpha) = fixture!("alpha.png");
    let over_white = |x, y| 1.0 - slopes(x, y)[0] * (1.0 - colour(x, y));
    assert!(greatest_error(&read(alpha).unwrap().picture, over_white) < 0.005);
}

#[test]
fn sixteen_bits_keep_their_shades() {
    let (_, bytes) = fixture!("grey-16.png");
    let picture = read(bytes).unwrap().picture;
    assert!((picture.row(0)[0] - 1.0 / 65_535.0).abs() < 1e-9);
    let (_, bytes) = fixture!("rgb-16.tif");
    let read = read(bytes).unwrap();
    assert_eq!(read.bits, 16);
    // Blue as drawn, green upside down, red mirrored.
    let mixed = |x: usize, y: usize| {
        WEIGHTS[0] * grey(WIDTH - 1 - x, y)
            + WEIGHTS[1] * grey(x, HEIGHT - 1 - y)
            + WEIGHTS[2] * grey(x, y)
    };
    assert!(greatest_error(&read.picture, mixed) < 0.003);
}

#[test]
fn full_scale_is_counted() {
    let (_, bytes) = fixture!("interlaced.png");
    let picture = read(bytes).unwrap();
    assert!((picture.saturated_ratio - 1.0 / 391.0).abs() < 1e-12, "{}", picture.saturated_ratio);
    let (_, bytes) = fixture!("one-bit.png");
    let ratio = read(bytes).unwrap().saturated_ratio;
    assert!((0.4..0.6).contains(&ratio), "{ratio}");
}

#[test]
fn written_pictures_are_read_back() {
    let values = (0..WIDTH * HEIGHT).map(|at| grey(at % WIDTH, at / WIDTH)).collect();
    let picture = Picture::new(WIDTH, HEIGHT, values).unwrap();
    assert!(greatest_error(&read(&write_png(&picture)).unwrap().picture, grey) < 0.002);
    for (quality, allowed) in [(100, 0.004), (90, 0.02), (20, 0.1)] {
        let bytes = write_jpeg(&picture, quality).unwrap();
        let error = greatest_error(&read(&bytes).unwrap().picture, grey);
        assert!(error < allowed, "{quality}: {error}");
    }
    let long = Picture::new(70_000, 1, vec![0.0; 70_000]).unwrap();
    assert!(write_jpeg(&long, 90).is_none());
}

#[test]
fn what_is_no_picture_is_named() {
    let message = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    let expected = "this is an empty file, expected a PNG, JPEG or TIFF picture";
    assert_eq!(message(b""), expected);
    assert!(message(b" <svg xmlns='x'/>").contains("an SVG"));
    assert!(message(b"\0\0\0\x18ftypheic").contains("HEIC"));
    assert!(message(b"{\"kind\":\"grid\"}").contains("JSON"));
    assert!(message(b"x,y\n1,2\n").contains("a text"));
    assert!(message(b"\x01\x02\xff").contains("begins with 01 02 ff"));
    for bytes in [fixture!("cmyk.jpg").1, fixture!("cmyk.tif").1] {
        assert!(message(bytes).contains("CMYK, inks for print; save it as"), "{}", message(bytes));
    }
}

#[test]
fn large_pictures_are_refused_from_their_header() {
    let size = |bytes: &mut Vec<u8>, at: usize, big: &[u8]| {
        bytes[at..at + big.len()].copy_from_slice(big);
    };
    let mut jpeg = fixture!("grey.jpg").1.to_vec();
    let at = jpeg.windows(2).position(|two| two == [0xff, 0xc0]).unwrap() + 5;
    size(&mut jpeg, at, &[0x27, 0x10, 0x4e, 0x20]);
    let mut png = fixture!("interlaced.png").1.to_vec();
    size(&mut png, 16, &[0, 0, 0x4e, 0x20, 0, 0, 0x27, 0x10]);
    let mut crc = flate2::Crc::new();
    crc.update(&png[12..29]);
    size(&mut png, 29, &crc.sum().to_be_bytes());
    for bytes in [jpeg, png] {
        let message = read(&bytes).unwrap_err().to_string();
        let expected = "20000 x 10000 are 200 megapixels, more than the limit of 100";
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn no_part_of_a_file_is_a_picture() {
    for (name, bytes) in GREY.into_iter().chain(COLOUR) {
        // Pillow's TIFFs end with the directory's values, or with padding.
        let spare = if name.ends_with("tif") { 16 } else { 0 };
        for length in 0..bytes.len() - spare {
            assert!(read(&bytes[..length]).is_err(), "{name}: {length} of {}", bytes.len());
        }
    }
    let (_, bytes) = fixture!("progressive.jpg");
    let expected = PictureFileError::Truncated { kind: "JPEG", n_bytes: bytes.len() / 2 };
    assert_eq!(read(&bytes[..bytes.len() / 2]).unwrap_err(), expected);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn damage_is_no_panic(
        which in 0..9usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        end in any::<prop::sample::Index>(),
    ) {
        let (_, bytes) = GREY.into_iter().chain(COLOUR).nth(which).unwrap();
        let mut bytes = bytes.to_vec();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let _ = read(&bytes);
        let _ = read(&bytes[..end.index(bytes.len())]);
    }
}
