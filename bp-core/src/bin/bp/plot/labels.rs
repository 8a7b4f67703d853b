//! The labels of axes and titles.
//!
//! In: numbers and names, and the room for them. Out: text that fits. Invariant: different ticks of an axis have different
//! labels, and different names keep different labels where there is room for five columns each.

use crate::wrap::columns;

/// A number of an axis, with enough digits to distinguish the ticks between its ends.
pub(super) fn tick_between(low: f64, high: f64) -> impl Fn(&f64) -> String {
    let (span, size) = (high - low, low.abs().max(high.abs()));
    // Ticks are at least a twentieth of the span apart: two digits beyond its first one.
    let decimals = (2.0 - span.log10().floor()).clamp(0.0, 17.0);
    let is_plain = (1e-4..1e6).contains(&size) || decimals == 0.0 && size < 1e6;
    let mantissa = ((size / span).log10().ceil().max(0.0) + 2.0).min(15.0) as usize;
    move |number| {
        let (text, power) = match is_plain || *number == 0.0 {
            true => (format!("{number:.0$}", decimals as usize), String::new()),
            false => {
                let text = format!("{number:.mantissa$e}");
                let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
                (digits.to_owned(), format!("e{power}"))
            }
        };
        let text = match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.'),
            false => &text,
        };
        if text == "-0" { "0".to_owned() } else { format!("{text}{power}").replace('-', "−") }
    }
}

/// The number of an instant or a step; nothing between two of them.
pub(super) fn at_whole(number: &f64) -> String {
    let nearest = number.round();
    if (number - nearest).abs() < 1e-6 { format!("{nearest}") } else { String::new() }
}

/// The label of each place that is shown; nothing between two of them.
pub(super) fn of_places(labels: &[String], each: usize) -> impl Fn(&f64) -> String + '_ {
    move |at| {
        let nearest = at.round();
        let place = nearest as usize;
        match (at - nearest).abs() < 1e-6 && nearest >= 0.0 && place.is_multiple_of(each) {
            true => labels.get(place).cloned().unwrap_or_default(),
            false => String::new(),
        }
    }
}

/// A number by itself: up to four digits, without trailing zeros.
pub(super) fn tick(number: &f64) -> String {
    let size = number.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) {
        return format!("{number:.1e}").replace('-', "−");
    }
    let digits = if size == 0.0 { 0 } else { (3 - size.log10().floor() as i32).clamp(0, 6) as usize };
    let text = format!("{number:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

/// The first characters of a text, in this many columns.
fn first(characters: impl Iterator<Item = char>, most: usize) -> String {
    let (mut taken, mut used) = (String::new(), 0);
    for character in characters {
        used += columns(character.encode_utf8(&mut [0; 4]));
        if used > most {
            break;
        }
        taken.push(character);
    }
    taken
}

/// A title that fits its panel. A character of Chinese, Japanese or Korean is two columns wide.
pub(super) fn shortened(text: &str, most: usize) -> String {
    match columns(text) > most {
        true => format!("{}…", first(text.chars(), most.saturating_sub(1))),
        false => text.to_owned(),
    }
}

/// A label that fits its place: its beginning and its end, since labels often differ in the latter.
pub(super) fn abridged(label: &str, most: usize) -> String {
    if columns(label) <= most {
        return label.to_owned();
    }
    let end: String = first(label.chars().rev(), most.saturating_sub(1) / 2).chars().rev().collect();
    format!("{}…{end}", first(label.chars(), most.saturating_sub(1 + columns(&end))))
}

/// The labels of places beside each other that have room for this many columns together, and the distance of the labels
/// that are shown: words are abridged, numbers left out at equal distances.
pub(super) fn fitted(labels: &[String], room: usize) -> (Vec<String>, usize) {
    let count = labels.len().max(1);
    let are_numbers = labels.iter().all(|label| label.parse::<f64>().is_ok());
    let most = if are_numbers { 40 } else { (room / count).saturating_sub(1).clamp(5, 40) };
    let fitted: Vec<String> = labels.iter().map(|label| abridged(label, most)).collect();
    let longest = fitted.iter().map(|label| columns(label)).max().unwrap_or(0);
    (fitted, ((longest * count) / room + 1).min(count))
}
