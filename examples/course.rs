//! Judges an answer to an exercise of the course: `cargo run --example course -- 1.2 0.81`.
//!
//! The answers and the hints for common mistakes are those of `docs/course/solutions.md`.

/// The solutions of the exercises.
const SOLUTIONS: &str = include_str!("../docs/course/solutions.md");

/// An answer is right if it differs by less than this share of it.
pub(crate) const SHARE: f64 = 0.005;

/// The number after the first ` = ` that follows a calculation.
fn stated(text: &str) -> Option<f64> {
    let number = text.split("` = ").nth(1)?.trim_start();
    let end = number.find(|character: char| !character.is_ascii_digit() && !"-.".contains(character));
    number[..end.unwrap_or(number.len())].trim_end_matches('.').parse().ok()
}

/// What to say about a number as the answer to an exercise such as `1.2`.
pub(crate) fn judge(exercise: &str, number: f64) -> Result<String, String> {
    let parts = SOLUTIONS.split("\n### ").skip(1).filter_map(|part| part.split_once('\n'));
    let named = parts.filter(|(name, _)| *name == exercise).map(|(_, text)| text).next();
    let text = named.ok_or_else(|| format!("the course has no exercise {exercise}"))?;
    let (answer, hints) = text
        .split_once("**Answer**")
        .and_then(|(_, rest)| rest.split_once("| if you got |"))
        .ok_or_else(|| format!("exercise {exercise} has no answer"))?;
    // The last calculation is the answer.
    let last = answer.replace("`\n= ", "` = ").replace("` =\n", "` = ");
    let last = last.rfind("` = ").map_or("", |at| &last[at..]).to_owned();
    let right = stated(&last).ok_or_else(|| format!("exercise {exercise} has no number"))?;
    let near = |other: f64| (number - other).abs() <= SHARE * other.abs();
    if near(right) {
        return Ok(format!("{number} is right."));
    }
    for row in hints.lines().filter(|line| line.starts_with("| `")) {
        if let (Some(wrong), Some(hint)) = (stated(row), row.split(" | ").nth(1))
            && near(wrong)
        {
            return Ok(hint.trim_end_matches(" |").to_owned());
        }
    }
    Ok(format!("{number} is not the answer, and none of the common mistakes: see the solution."))
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let judged = match arguments.as_slice() {
        [exercise, number] => match number.parse() {
            Ok(number) => judge(exercise, number),
            Err(_) => Err(format!("`{number}` is not a number")),
        },
        _ => Err("expected an exercise and a number, such as `1.2 0.81`".to_owned()),
    };
    println!("{}", judged.unwrap_or_else(|error| error));
    assert!(judge("1.1", 0.5 * 0.1 / 0.3).is_ok_and(|said| said.contains("is right")));
}
