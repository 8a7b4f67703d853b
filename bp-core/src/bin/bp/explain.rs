//! `bp explain`: derives the answer from the program, step by step.
//!
//! In: a program and a question. Out: the derivation and its cost, as text, LaTeX, JSON or a page of HTML. Invariant:
//! every output shows the same steps of the same plan.

use crate::ask::{self, setting};
use crate::cost::{self, Table};
use crate::data::Separator;
use crate::failure::{Failure, colour};
use crate::numbers::count;
use crate::output;
use crate::parameters::{self, Free};
use crate::planning::Planning;
use crate::{html, latex, program, rows, wrap};
use bp_core::compiler::answer::{link, plan_sized};
use bp_core::compiler::data::PlateData;
use bp_core::compiler::distribution::Setting;
use bp_core::compiler::error::Error;
use bp_core::compiler::kernel::in_words;
use bp_core::compiler::lower::lower_printed;
use bp_core::compiler::model::{Model, ParameterKind, Question};
use bp_core::compiler::plan::{Marked, Notation, Offer, Options, Plan, plan_or_contexts};
use bp_core::program::settings::{Meaning, Settings, names, values_of};
use serde_json::json;
use std::borrow::Cow;
use std::io::Write;
use std::path::PathBuf;

/// Derive the equation that answers a question, step by step.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp explain wet_grass.bp
  bp explain wet_grass.bp 'P(Rain | Wet = true)'
  bp explain wet_grass.bp --html --out wet_grass.html
  bp explain line.bp 'P(A)' --rows points.csv     (as bp ask answers it of these rows)
  bp explain mail.bp 'P(Spam | W)' --set N=60     (a family of 60 words)
  bp explain cell.bp step --layout                (memory layout of the loops)
  bp explain wet_grass.bp rain --forms            (0.3 in place of P(Rain = true))
  bp explain cell.bp state --latex > state.tex    (uses the package amsmath)
  bp explain cell.bp --latex --standalone --out cell.tex")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// A question, or the name of a declared one; all declared questions if left out.
    question: Option<String>,
    /// Show the memory layout of the loops: passes, contiguous axes, buffers, bytes read and written.
    #[arg(long, conflicts_with_all = ["latex", "html"])]
    layout: bool,
    #[command(flatten)]
    planning: Planning,
    /// A table whose rows are the elements of a set of the program, as of `bp ask`; may be repeated.
    #[arg(long, value_name = "[SET=]FILE", conflicts_with = "html")]
    rows: Vec<String>,
    /// With --rows: columns to ignore.
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',', requires = "rows")]
    ignore: Vec<String>,
    #[command(flatten)]
    separator: Separator,
    /// Set a size, a parameter, or a value that the question leaves open, as of `bp ask`; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, conflicts_with = "html", allow_hyphen_values = true)]
    settings: Vec<String>,
    /// Show the forms too: the equation that is computed with the form of each factor in its place, and each form.
    #[arg(long)]
    forms: bool,
    /// Write paragraphs for LaTeX, whose lines TeX breaks; they need amsmath.
    #[arg(long, conflicts_with_all = ["json", "html"])]
    latex: bool,
    /// With --latex: write a complete document.
    #[arg(long, requires = "latex")]
    standalone: bool,
    /// Write the steps as JSON.
    #[arg(long, conflicts_with = "html")]
    json: bool,
    /// Write a self-contained HTML page: program, network, derivation, cost.
    #[arg(long)]
    html: bool,
    /// Write to this file instead of stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (network, source) = program::with_source(&arguments.file)?;
    // A page can show a program without questions.
    let (typed, rows) = (arguments.question.as_deref(), &arguments.rows);
    let rows =
        rows::read(&network.model, rows, &arguments.settings, &arguments.separator, &arguments.ignore)?;
    let questions = match arguments.html {
        true => program::shown(&network, typed)?,
        false => program::asked_of_rows(&network, typed, &rows)?,
    };
    let model = network.model;
    let posed = |question| {
        let (model, asked) = model.posed(question);
        let asked = ask::set(&model, &asked, &arguments.settings);
        (model, asked)
    };
    // What one derives is no part of the others.
    let questions: Vec<Posed<'_>> = questions.iter().map(posed).collect();
    let options = Options { all_offers: true, ..arguments.planning.options() };
    let mut page = Vec::new();
    if arguments.html {
        let planned = |(model, asked): &'_ Posed<'_>| {
            by_structure(model, asked, options).map(|(model, plan)| (Cow::Owned(model.into_owned()), plan))
        };
        let plans = questions.iter().map(planned).collect::<Result<Vec<Planned<'_>>, Error>>()?;
        html::write(&model, &source.text, &plans, arguments.forms, &mut page)?;
        return output::write(arguments.out.as_deref(), &page, out);
    }
    let is_set = !rows.is_empty() || !arguments.settings.is_empty();
    let sizes = || sized(&model, &questions, &arguments.settings, &rows);
    let settings = is_set.then(sizes).transpose()?;
    let mut plans: Vec<Planned<'_>> = Vec::with_capacity(questions.len());
    for (model, one) in &questions {
        plans.push(match &settings {
            None => by_structure(model, one, options).or_else(|refused| {
                // Families whose sizes are known may have an answer element by element.
                let planned = sizes()
                    .map_err(|_| ())
                    .and_then(|by| plan_sized(model, one, options, &by.inputs()).map_err(|_| ()));
                planned.map_err(|()| refused)
            }),
            Some(settings) => plan_sized(model, one, options, &settings.inputs()),
        }?);
    }
    // Of the program as it is written: families that are written out have a form for each element.
    let inputs = settings.as_ref().map(Settings::inputs);
    let sizes: Vec<Option<Setting<'_>>> = (questions.iter())
        .map(|(model, _)| inputs.as_ref().and_then(|inputs| Setting::new(model, inputs).ok()))
        .collect();
    let sized = questions.iter().zip(&sizes).map(|((model, _), sizes)| (model.as_ref(), sizes.as_ref()));
    if arguments.json {
        let free: Vec<Free> = sized.map(|(model, sizes)| parameters::free(model, sizes)).collect();
        write_json(&plans, &free, (arguments.layout, arguments.forms), &mut page)?;
    } else if arguments.latex {
        let model = if let [(own, _)] = questions.as_slice() { own } else { &model };
        write_latex(model, &plans, arguments.standalone, arguments.forms, &mut page)?;
        if arguments.standalone {
            latex::check(&String::from_utf8_lossy(&page))?;
        }
    } else {
        let bold = arguments.out.is_none() && colour(&std::io::stdout());
        for (position, ((model, plan), (own, sizes))) in plans.iter().zip(sized).enumerate() {
            if position > 0 {
                writeln!(page)?;
            }
            let free = parameters::in_words(own, sizes);
            write_text((model, &free), plan, bold, arguments.forms, &mut page)?;
            if arguments.layout {
                for line in layout(model, plan)? {
                    write!(page, "{}", wrap::wrapped("layout: ", &line, 4))?;
                }
            }
        }
    }
    output::write(arguments.out.as_deref(), &page, out)
}

/// The plan of a question without sizes.
fn by_structure<'m>(model: &'m Model, question: &Question, options: Options) -> Result<Planned<'m>, Error> {
    let model = Model::with_constants(Cow::Borrowed(model), question);
    let plan = plan_or_contexts(&model, question, options)?;
    Ok((model, plan))
}

/// A question, and the program in which it is posed.
type Posed<'m> = (Cow<'m, Model>, Question);

/// A plan, and the program of which it is the plan.
type Planned<'m> = (Cow<'m, Model>, Plan);

/// The sizes that rows and settings tell; a parameter without a number has 1, since a plan depends on sizes alone. A size that
/// is not known has none.
fn sized(
    model: &Model,
    questions: &[Posed<'_>],
    typed: &[String],
    rows: &PlateData,
) -> Result<Settings, Failure> {
    let mut known = names(model);
    for (model, question) in questions {
        known.extend(values_of(model, question)?);
    }
    let mut settings = Settings::read(model, typed, &known)?.with_rows(rows).with_inferred_sizes(model);
    for (id, parameter) in model.parameters.iter() {
        if parameter.default.is_empty()
            && parameter.kind != ParameterKind::Size
            && !settings.has(&parameter.name)
        {
            let number = if let ParameterKind::Element(_) = parameter.kind { 0_i64 } else { 1 };
            settings.set(model, &parameter.name, &number.into(), Meaning::Parameter(id))?;
        }
    }
    Ok(settings)
}

/// The memory accesses of the loops of a plan, one line each; nothing if it has no loops.
fn layout(model: &Model, plan: &Plan) -> Result<Vec<String>, Failure> {
    let model = link(model)?;
    let mut lines = Vec::new();
    for route in &plan.routes {
        if let Some(exact) = route.exact() {
            lines.extend(in_words(&lower_printed(&model, exact, &plan.question.name)?.kernel));
        }
    }
    Ok(lines)
}

/// The question, as a user would type it.
pub(crate) fn asked(model: &Model, question: &Question) -> String {
    question.asks.iter().map(|ask| model.ask_text(ask)).collect::<Vec<_>>().join("; ")
}

/// The steps of a derivation, and the forms if they are wanted.
pub(crate) fn derived(
    model: &Model,
    plan: &Plan,
    forms: bool,
    notation: Notation,
) -> Vec<(String, String, String)> {
    let mut steps = plan.derivation(model, notation);
    if forms {
        steps.extend(plan.forms(model, notation));
    }
    steps
}

/// The routes of a plan, each once.
pub(crate) fn routes(plan: &Plan) -> String {
    let mut reasons: Vec<_> = plan.routes.iter().map(|route| route.reason()).collect();
    reasons.dedup();
    reasons.join("; ")
}

fn write_text(
    (model, free): (&Model, &str),
    plan: &Plan,
    bold: bool,
    forms: bool,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let (bold, plain) = if bold { ("\x1b[1m", "\x1b[0m") } else { ("", "") };
    let title = format!("program {}: {}", model.name, asked(model, &plan.question));
    write!(out, "{}", wrap::wrapped("", &title, 4))?;
    for (position, (rule, reason, equation)) in
        derived(model, plan, forms, Notation::Unicode).iter().enumerate()
    {
        let number = position + 1;
        writeln!(out, "\n{number:>2}. {bold}{rule}{plain}")?;
        write!(out, "{}", wrap::wrapped("    ", reason, 4))?;
        write!(out, "{}", wrap::wrapped_equation("      ", equation, 10))?;
    }
    writeln!(out)?;
    write!(out, "{}", wrap::wrapped("decomposition: ", free, 4))?;
    write!(out, "{}", wrap::wrapped("route: ", &routes(plan), 4))?;
    for offer in plan.offers.iter().flatten() {
        write!(out, "{}", wrap::wrapped("offer: ", &offered(offer), 4))?;
    }
    for table in cost::tables(model, plan) {
        write!(out, "{}", cost::as_text(&table))?;
    }
    for equation in plan.computed(model, Notation::Unicode) {
        write!(out, "{}", wrap::wrapped_equation("computed: ", &equation, 10))?;
    }
    for marked in plan.marks(model, Notation::Unicode) {
        let Marked { product, mark, reason } = marked;
        write!(out, "{}", wrap::wrapped("range: ", &format!("{}, {reason}", mark.word()), 4))?;
        write!(out, "{}", wrap::wrapped_equation("      ", &product, 10))?;
    }
    Ok(())
}

/// The offer of a strategy, as text.
fn offered(offer: &Offer) -> String {
    let name = offer.strategy.name();
    match (&offer.refusal, offer.products) {
        (Some(reason), _) => format!("{name}, refused: {reason}"),
        (None, products) => {
            let kind = if offer.exact { "exact" } else { "estimate" };
            let cost = products.map_or(String::new(), |products| format!(", {} products", count(products)));
            let taken = offer.choice.as_ref().map_or(String::new(), |choice| format!(": taken, {choice}"));
            format!("{name}, {kind}{cost}{taken}")
        }
    }
}

fn write_latex(
    model: &Model,
    plans: &[Planned<'_>],
    standalone: bool,
    forms: bool,
    out: &mut impl Write,
) -> std::io::Result<()> {
    if standalone {
        latex::open(model, out)?;
        latex::paragraph(&parameters::in_words(model, None), out)?;
    }
    for (position, (model, plan)) in plans.iter().enumerate() {
        let asked = asked(model, &plan.question);
        match standalone {
            true => latex::heading(&asked, out)?,
            false if position > 0 => writeln!(out)?,
            false => {}
        }
        latex::write(model, plan, &asked, forms, out)?;
        if standalone {
            latex::paragraph(&format!("Route: {}", routes(plan)), out)?;
            for Marked { product, mark, reason } in plan.marks(model, Notation::Latex) {
                let mark = format!("Range of numbers: {}, {reason}", mark.word());
                latex::paragraph_with(&mark, &product, out)?;
            }
            cost::tables(model, plan).iter().try_for_each(|table| latex::cost(table, out))?;
        }
    }
    if standalone { latex::close(out) } else { Ok(()) }
}

fn write_json(
    plans: &[Planned<'_>],
    free: &[Free],
    (with_layout, forms): (bool, bool),
    out: &mut impl Write,
) -> Result<(), Failure> {
    let mut documents: Vec<_> =
        plans.iter().zip(free).map(|((model, plan), free)| as_json((model, *free), plan, forms)).collect();
    if with_layout {
        for (document, (model, plan)) in documents.iter_mut().zip(plans) {
            document["layout"] = json!(layout(model, plan)?);
        }
    }
    let text = match documents.as_slice() {
        [one] => one.to_string(),
        several => json!(several).to_string(),
    };
    Ok(writeln!(out, "{text}")?)
}

fn as_json((model, free): (&Model, Free), plan: &Plan, forms: bool) -> serde_json::Value {
    let steps: Vec<_> = (derived(model, plan, forms, Notation::Unicode).into_iter())
        .zip(derived(model, plan, forms, Notation::Latex))
        .zip(derived(model, plan, forms, Notation::MathMl))
        .map(|(((rule, reason, equation), (_, _, latex)), (_, _, mathml))| {
            json!({ "rule": rule, "reason": reason, "equation": equation, "latex": latex, "mathml": mathml })
        })
        .collect();
    let costs: Vec<Table> = cost::tables(model, plan);
    let range: Vec<_> = (plan.marks(model, Notation::Unicode).into_iter())
        .map(|Marked { product, mark, reason }| {
            json!({ "product": product, "mark": mark.word(), "reason": reason })
        })
        .collect();
    json!({
        "question": asked(model, &plan.question),
        "route": routes(plan),
        "offers": plan.offers.iter().flatten().collect::<Vec<_>>(),
        "steps": steps,
        "computed": plan.computed(model, Notation::Unicode),
        "free_parameters": free.forms,
        "free_parameters_of_tables": free.tables,
        "free_parameters_of_joint": free.joint,
        "cost": costs,
        "range": range,
    })
}
