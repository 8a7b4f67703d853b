//! The command `bp`: Bayesian Programs from the shell.
//!
//! In: a subcommand and files. Out: text on stdout, errors on stderr, and an exit status: 0 on success, 1 if a program,
//! a question or data are wrong, 2 if the command line is wrong. Invariant: a reader that closes the pipe ends the
//! command quietly.

mod answered;
mod ask;
mod cases;
mod check;
mod completions;
mod convert;
mod cost;
mod data;
mod draw;
mod emit;
mod explain;
mod failure;
mod format;
mod highlight;
mod html;
mod latex;
mod learn;
mod learned;
mod lsp;
mod network;
mod new;
mod output;
mod over_time;
mod page;
mod parameters;
mod planning;
#[cfg(feature = "plot")]
mod plot;
#[cfg(not(feature = "plot"))]
#[path = "no_plot.rs"]
mod plot;
mod print;
mod program;
mod reference;
mod rows;
#[cfg(feature = "serve")]
mod serve;
mod signals;

use bp_core::compiler::{numbers, wrap};

use clap::{CommandFactory, Parser, Subcommand};
use failure::Failure;
use std::io::{BufWriter, Write};
use std::process::ExitCode;

/// Check, explain, answer, draw, compile and learn Bayesian Programs.
#[derive(Parser)]
#[command(name = "bp", version, max_term_width = 80, after_help = EXAMPLES)]
struct CommandLine {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  bp new lawn
  bp check wet_grass.bp
  bp ask wet_grass.bp 'P(Rain | Wet = true)'
  bp explain wet_grass.bp 'P(Rain | Wet = true)'
  bp explain wet_grass.bp --html --out wet_grass.html
  bp draw wet_grass.bp rain --out wet_grass.svg
  bp print wet_grass.bp --latex --standalone --out figure.tex
  bp print wet_grass.bp --interactive --out wet_grass.html
  bp serve wet_grass.bp
  bp emit cell.bp step --to wgsl
  bp learn spam.bp --data mails.csv --out learned.bp
  bp convert alarm.bif alarm.bp
  bp fmt --check *.bp
  bp reference poisson

Exit status: 0 on success; 1 if a program, a question or data are wrong; 2 if
the command line is wrong. Ctrl-C ends a command with exit status 1; an estimate
by sampling is then printed from the draws made so far.";

#[derive(Subcommand)]
enum Verb {
    Check(check::Arguments),
    Fmt(format::Arguments),
    Explain(explain::Arguments),
    Ask(ask::Arguments),
    Draw(draw::Arguments),
    Print(print::Arguments),
    Emit(emit::Arguments),
    Marginals(network::marginals::Arguments),
    Mpe(network::mpe::Arguments),
    Joint(network::joint::Arguments),
    Observe(network::observe::Arguments),
    Batch(network::batch::Arguments),
    Cost(network::size::Arguments),
    Convert(convert::Arguments),
    Completions(completions::Arguments),
    Learn(learn::Arguments),
    Lsp(lsp::Arguments),
    New(new::Arguments),
    Reference(reference::Arguments),
    #[cfg(feature = "serve")]
    Serve(serve::Arguments),
}

fn main() -> ExitCode {
    bp_core::compiler::door::enter(bp_core::compiler::door::Door::Command);
    let CommandLine { verb } = CommandLine::parse();
    // A signal is the way to end a server.
    #[cfg(feature = "serve")]
    let is_server = matches!(verb, Verb::Serve(_));
    #[cfg(not(feature = "serve"))]
    let is_server = false;
    signals::listen(if is_server { 0 } else { signals::INTERRUPTED });
    if let Verb::Lsp(arguments) = &verb {
        // Its own thread writes to stdout.
        return lsp::run(arguments).map_or_else(Failure::report, |()| ExitCode::SUCCESS);
    }
    #[cfg(feature = "serve")]
    if let Verb::Serve(arguments) = &verb {
        return serve::run(arguments).map_or_else(Failure::report, |()| ExitCode::SUCCESS);
    }
    let mut out = BufWriter::new(std::io::stdout().lock());
    let done = match verb {
        Verb::Check(arguments) => check::run(&arguments, &mut out),
        Verb::Fmt(arguments) => format::run(&arguments, &mut out),
        Verb::Explain(arguments) => explain::run(&arguments, &mut out),
        Verb::Ask(arguments) => ask::run(&arguments, &mut out),
        Verb::Draw(arguments) => draw::run(&arguments, &mut out),
        Verb::Print(arguments) => print::run(&arguments, &mut out),
        Verb::Emit(arguments) => emit::run(&arguments, &mut out),
        Verb::Marginals(arguments) => network::marginals::run(&arguments, &mut out),
        Verb::Batch(arguments) => network::batch::run(&arguments, &mut out),
        Verb::Joint(arguments) => network::joint::run(&arguments, &mut out),
        Verb::Observe(arguments) => network::observe::run(&arguments, &mut out),
        Verb::Mpe(arguments) => network::mpe::run(&arguments, &mut out),
        Verb::Cost(arguments) => network::size::run(&arguments, &mut out),
        Verb::Convert(arguments) => convert::run(&arguments, &mut out),
        Verb::Completions(arguments) => completions::run(&arguments, CommandLine::command(), &mut out),
        Verb::Learn(arguments) => learn::run(&arguments, &mut out),
        Verb::Lsp(arguments) => lsp::run(&arguments),
        Verb::New(arguments) => new::run(&arguments, &mut out),
        Verb::Reference(arguments) => reference::run(&arguments, &mut out),
        #[cfg(feature = "serve")]
        Verb::Serve(arguments) => serve::run(&arguments),
    };
    let flushed = out.flush().map_err(Failure::Output);
    match done.and(flushed) {
        Ok(()) if bp_core::compiler::progress::is_stopped() => {
            program::warn("warning: interrupted; the answer is from the work done so far");
            ExitCode::from(signals::INTERRUPTED as u8)
        }
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
