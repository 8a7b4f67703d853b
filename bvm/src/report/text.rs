//! Text in a picture.
//!
//! In: a text, a pixel, and the anchor of the text at that pixel. Out: drawn text. The vertical anchors refer to the
//! capital letters (top, middle, base line), so that labels align with their ticks. Invariant: sizes are canvas pixels,
//! twice those of the finished picture.

use super::colour::INK;
use super::picture::{Canvas, Drawn, FONT};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of the text of ticks and legends.
pub(super) const TEXT: i32 = 30;
/// Size of the text of titles.
pub(super) const TITLE: i32 = 36;

/// The style of a text, with its anchor.
#[derive(Clone, Copy)]
pub(super) struct Text {
    size: i32,
    bold: bool,
    turned: bool,
    colour: RGBColor,
    across: HPos,
    upright: VPos,
}

impl Text {
    /// Plain text of the given size.
    pub(super) fn new(size: i32, across: HPos, upright: VPos) -> Text {
        Text { size, bold: false, turned: false, colour: INK, across, upright }
    }

    /// The same in bold.
    pub(super) fn bold(self) -> Text {
        Text { bold: true, ..self }
    }

    /// The same, read from bottom to top; the anchors turn with the text.
    pub(super) fn turned(self) -> Text {
        Text { turned: true, ..self }
    }

    /// The same in another colour.
    pub(super) fn coloured(self, colour: RGBColor) -> Text {
        Text { colour, ..self }
    }

    fn style(self) -> TextStyle<'static> {
        let weight = if self.bold { FontStyle::Bold } else { FontStyle::Normal };
        let turn = if self.turned { FontTransform::Rotate270 } else { FontTransform::None };
        let mut style = TextStyle::from((FONT, self.size, weight).into_font().transform(turn))
            .pos(Pos::new(self.across, self.upright));
        style.color = self.colour.to_backend_color();
        style
    }

    /// Width in pixels of a text, along its own line.
    pub(super) fn width(self, canvas: &Canvas, text: &str) -> i32 {
        let (width, height) =
            canvas.estimate_text_size(text, &self.style()).unwrap_or((0, self.size.unsigned_abs()));
        (if self.turned { height } else { width }) as i32
    }

    /// Writes the text with its anchor at a pixel.
    pub(super) fn write(self, canvas: &Canvas, text: &str, (x, y): (i32, i32)) -> Drawn {
        // plotters places the base line half a size below the top of a box that is 1 / 1.24 of the size high; capitals
        // of the included font are 0.627 of the size high.
        let lower = match self.upright {
            VPos::Top => 0.127,
            VPos::Center => 0.217,
            VPos::Bottom => 0.306,
        };
        let shift = (lower * f64::from(self.size)).round() as i32;
        let at = if self.turned { (x + shift, y) } else { (x, y + shift) };
        canvas.draw_text(text, &self.style(), at)
    }
}
