//! Random damage never panics.

use crate::bad_input::{HEAD, LINE, outcome};
use proptest::prelude::*;

/// A drawing with something of everything, to be damaged.
const VALID: &str = include_str!("../golden/inkscape.svg");

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_bytes_do_not_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        outcome(&bytes);
    }

    #[test]
    fn random_markup_does_not_panic(
        parts in proptest::collection::vec(
            prop::sample::select(vec![
                "<", ">", "/>", "</", "g", "path", " d='", "M0 0", "A1 2 3 4 5 6 7", "'", "=",
                "<style>", "</style>", "{", "}", ".a", "fill:url(#x)", "@media", ";", ",", "/*",
                "<text x='1 2'>", "</text>", "<tspan>", "&lt;", "&#0;", "<![CDATA[", "]]>", "1e9",
                "<use href='#a' id='a'/>", "<svg>", "</svg>", "stroke-dasharray='0 1'", "%", "-",
            ]),
            0..60,
        )
    ) {
        outcome(format!("{HEAD}{LINE}{}</svg>", parts.concat()).as_bytes());
    }

    #[test]
    fn cut_files_do_not_panic(length in 0..VALID.len()) {
        outcome(&VALID.as_bytes()[..length]);
    }

    #[test]
    fn changed_files_do_not_panic(
        changes in proptest::collection::vec((0..VALID.len(), any::<u8>()), 1..20)
    ) {
        let mut bytes = VALID.as_bytes().to_vec();
        for (index, byte) in changes {
            bytes[index] = byte;
        }
        outcome(&bytes);
    }

    #[test]
    fn shuffled_files_do_not_panic(
        from in 0..VALID.len(), to in 0..VALID.len(), length in 0..200usize
    ) {
        let mut bytes = VALID.as_bytes().to_vec();
        let end = (from + length).min(bytes.len());
        let piece: Vec<u8> = bytes.drain(from..end).collect();
        let to = to.min(bytes.len());
        bytes.splice(to..to, piece);
        outcome(&bytes);
    }
}
