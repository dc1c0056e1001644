//! A figure as a file: SVG as it was drawn, or PNG.

use super::exit::UsageError;
use anyhow::Context;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::path::Path;

/// Pixels for each of the figure's units: lines and letters stay sharp on a dense screen and on paper.
const PIXELS: f32 = 2.0;
/// The font that figures ask for, so that they look alike on every machine, also on one without fonts.
const FAMILY: &str = "DejaVu Sans";
const FONTS: [&[u8]; 2] = [
    include_bytes!("fonts/DejaVuSans.ttf"),
    include_bytes!("fonts/DejaVuSans-Bold.ttf"),
];

/// Endings of pictures that are not written.
const OTHERS: [&str; 9] = [
    "pdf", "jpg", "jpeg", "gif", "webp", "tif", "tiff", "eps", "ps",
];

/// Writes the figure as PNG where the file's name ends in `.png`, else as the SVG that it is.
pub(super) fn write(file: &Path, svg: &str) -> anyhow::Result<()> {
    let ends_in =
        |name: &str| (file.extension()).is_some_and(|ending| ending.eq_ignore_ascii_case(name));
    if OTHERS.into_iter().any(ends_in) {
        let text = format!(
            "{}: figures are written as SVG or PNG, expected a name that ends in .svg or .png",
            file.display()
        );
        anyhow::bail!(UsageError(text));
    }
    let bytes = if ends_in("png") {
        png(svg)?
    } else {
        svg.as_bytes().to_vec()
    };
    std::fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))
}

fn png(svg: &str) -> anyhow::Result<Vec<u8>> {
    let mut options = Options {
        font_family: FAMILY.to_owned(),
        ..Options::default()
    };
    for font in FONTS {
        options.fontdb_mut().load_font_data(font.to_vec());
    }
    let tree = Tree::from_str(svg, &options).context("the figure cannot be drawn as PNG")?;
    let size = tree.size().to_int_size().scale_by(PIXELS);
    let pixels = size.and_then(|size| Pixmap::new(size.width(), size.height()));
    let mut pixels = pixels.context("the figure is too large for a PNG")?;
    let scale = Transform::from_scale(PIXELS, PIXELS);
    resvg::render(&tree, scale, &mut pixels.as_mut());
    pixels.encode_png().context("the PNG cannot be written")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(text: &str) -> Pixmap {
        let svg = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 20" width="40" height="20" font-family="{FAMILY}, sans-serif"><rect width="40" height="20" fill="#fff"/><text x="4" y="15">{text}</text></svg>"##
        );
        let picture = Pixmap::decode_png(&png(&svg).unwrap()).unwrap();
        assert_eq!((picture.width(), picture.height()), (80, 40));
        picture
    }

    #[test]
    fn letters_and_signs_of_figures_are_drawn_without_any_font_on_the_machine() {
        let ink = |picture: &Pixmap| picture.pixels().iter().any(|one| one.red() < 128);
        assert!(!ink(&drawn("")));
        // What the fonts lack is a box, or nothing.
        let lacking = drawn("漢");
        for sign in ["a", "κ", "ö", "Ж", "−", "≥", "→", "▲", "²", "…"] {
            let picture = drawn(sign);
            assert!(ink(&picture) && picture != lacking, "{sign}");
        }
    }
}
