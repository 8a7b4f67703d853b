//! A writer of Rust text.
//!
//! In: lines. Out: indented text. Invariant: every block that is opened is closed.

/// Rust text.
#[derive(Default)]
pub(super) struct Text {
    text: String,
    depth: usize,
}

impl Text {
    /// One or more lines.
    pub(super) fn line(&mut self, line: impl AsRef<str>) {
        for line in line.as_ref().lines() {
            self.text.push_str(&"    ".repeat(self.depth));
            self.text.push_str(line);
            self.text.push('\n');
        }
    }

    /// The documentation of the next item.
    pub(super) fn documented(&mut self, lines: &[String]) {
        for (number, line) in lines.iter().enumerate() {
            if number > 0 {
                self.line("///");
            }
            self.line(format!("/// {}", in_a_comment(line)));
        }
    }

    /// Opens a block.
    pub(super) fn open(&mut self, head: impl AsRef<str>) {
        self.line(format!("{} {{", head.as_ref()));
        self.depth += 1;
    }

    /// Closes a block.
    pub(super) fn close(&mut self) {
        self.close_with("}");
    }

    /// Closes a block with more than a brace.
    pub(super) fn close_with(&mut self, end: &str) {
        self.depth = self.depth.checked_sub(1).expect("internal: a block is closed that was not opened");
        self.line(end);
    }

    pub(super) fn finish(self) -> String {
        assert_eq!(self.depth, 0, "internal: a block is left open");
        self.text
    }
}

/// Text for a comment: names may contain line ends, and characters that change the direction of text.
pub(super) fn in_a_comment(text: &str) -> String {
    let is_unsafe = |letter: char| {
        letter.is_control()
            || matches!(letter, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    text.chars().map(|letter| if is_unsafe(letter) { ' ' } else { letter }).collect()
}

/// The words of a text: names, numbers, keywords.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty())
}
