//! The free memory for another array.
//!
//! In: reports of the operating system. Out: bytes. Invariant: lack of memory may refuse a question, but never selects
//! a strategy; without a report nothing is refused.
//!
//! On Linux: the minimum of `MemAvailable`, of the remaining limit of the control group, and of the remaining address
//! space (`ulimit -v`).

use std::fs::read_to_string;

/// Available bytes; `None` if the system does not report them.
pub(crate) fn free() -> Option<f64> {
    [available(), in_group(), in_limit()].into_iter().flatten().reduce(f64::min)
}

/// Bytes for display: `7.8 GB`.
pub(crate) fn bytes_text(bytes: f64) -> String {
    const UNITS: [&str; 7] = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
    if bytes >= 1e21 {
        return format!("{} B", count_text(bytes));
    }
    let unit = (bytes.max(1.0).log10() / 3.0).floor().min(6.0);
    let amount = bytes / 1000f64.powf(unit);
    let digits = usize::from(unit > 0.0 && amount < 100.0);
    format!("{amount:.digits$} {}", UNITS[unit as usize])
}

/// A count for display: `4096`, `4.3e9`.
pub(crate) fn count_text(count: f64) -> String {
    match count {
        _ if count.is_infinite() => "more than 1e308".to_owned(),
        _ if count < 1e7 => format!("{count:.0}"),
        _ => {
            let text = format!("{count:.1e}");
            text.replace(".0e", "e")
        }
    }
}

/// The available memory of the machine.
fn available() -> Option<f64> {
    field(&read_to_string("/proc/meminfo").ok()?, "MemAvailable:").map(|kilobytes| kilobytes * 1024.0)
}

/// The remaining memory of the control group.
fn in_group() -> Option<f64> {
    let number = |path: String| read_to_string(path).ok()?.trim().parse::<f64>().ok();
    let groups = read_to_string("/proc/self/cgroup").ok()?;
    let path = |wanted: &str| {
        groups.lines().find_map(|line| {
            let mut parts = line.splitn(3, ':').skip(1);
            let (controllers, path) = (parts.next()?, parts.next()?);
            controllers.split(',').any(|one| one == wanted).then(|| path.trim_end_matches('/').to_owned())
        })
    };
    let second = path("").and_then(|path| {
        let of = |file: &str| number(format!("/sys/fs/cgroup{path}/{file}"));
        Some(of("memory.max")? - of("memory.current")?)
    });
    let first = path("memory").and_then(|path| {
        let of = |file: &str| number(format!("/sys/fs/cgroup/memory{path}/{file}"));
        Some(of("memory.limit_in_bytes")? - of("memory.usage_in_bytes")?)
    });
    second.or(first).map(|bytes| bytes.max(0.0))
}

/// The remaining address space.
fn in_limit() -> Option<f64> {
    let most = field(&read_to_string("/proc/self/limits").ok()?, "Max address space")?;
    let taken = field(&read_to_string("/proc/self/status").ok()?, "VmSize:")? * 1024.0;
    Some((most - taken).max(0.0))
}

/// The number after a name at the start of a line.
fn field(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_printed_in_readable_units() {
        assert_eq!([8.0, 8e9, 123e6].map(bytes_text), ["8 B", "8.0 GB", "123 MB"]);
        assert_eq!([4096.0, 4_294_967_296.0, 1e9].map(count_text), ["4096", "4.3e9", "1e9"]);
        assert_eq!(count_text(f64::INFINITY), "more than 1e308");
    }

    #[test]
    fn a_field_is_read_by_its_name() {
        let text =
            "MemTotal:       16 kB\nMemAvailable:   12 kB\nMax address space         unlimited  unlimited";
        assert_eq!((field(text, "MemAvailable:"), field(text, "Max address space")), (Some(12.0), None));
    }
}
