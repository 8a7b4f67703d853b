//! What Rust alone needs for the work that `batch.py` gives to Python: a batch, and one answer.
//!
//! In: a network, a CSV file of cases, a file for the numbers, the number of runs, names of variables. Out: lines of a name
//! and a number: seconds and processor seconds of the run of least time, the largest resident memory in MiB, microseconds of
//! an answer about one coin. The numbers go to the file, row by row, as little-endian float64.

use bp_core::compiler::data;
use bp_core::prelude::*;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

const COIN: &str = "program Coin { variables { Heads : bool; } decomposition { P(Heads) } forms { P(Heads) = bernoulli(0.5); } }";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|one| one != "--bench").collect();
    let [network, cases, numbers, runs, only @ ..] = arguments.as_slice() else {
        return Err(
            "give a network, a file of cases, a file for the numbers, a number of runs, and names".into()
        );
    };
    let program = Program::open(network)?;
    let cases = Cases::of_records(data::open(Path::new(cases), None)?).only(only);
    let mut best = [f64::INFINITY; 2];
    for run in 0..runs.parse()? {
        let (begun, busy) = (Instant::now(), processor_seconds()?);
        let found = program.batch_with(&cases, || ())?;
        let seconds = begun.elapsed().as_secs_f64();
        if seconds < best[0] {
            best = [seconds, processor_seconds()? - busy];
        }
        if run == 0 {
            let mut file = BufWriter::new(std::fs::File::create(numbers)?);
            for row in found.rows {
                row?.iter().try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
            }
            file.flush()?;
        }
    }
    println!("seconds {}\nprocessor {}\nmemory {}\nask {}", best[0], best[1], memory()?, ask()?);
    Ok(())
}

/// Microseconds of an answer, the least of 20 times 1000.
fn ask() -> Result<f64, Error> {
    let program = Program::parse(COIN)?;
    let question = program.question("P(Heads)")?;
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let begun = Instant::now();
        for _ in 0..1000 {
            std::hint::black_box(question.ask()?);
        }
        best = best.min(begun.elapsed().as_secs_f64() * 1e3);
    }
    Ok(best)
}

/// Processor time of all threads of this process, s.
fn processor_seconds() -> Result<f64, Box<dyn std::error::Error>> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    // After the name in brackets: user and system time are the 12th and 13th field, in hundredths.
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
    Ok(ticks.sum::<Result<f64, _>>()? / 100.0)
}

/// The largest resident memory so far, MiB.
fn memory() -> Result<f64, Box<dyn std::error::Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    Ok(line.trim().trim_end_matches(" kB").parse::<f64>()? / 1024.0)
}
