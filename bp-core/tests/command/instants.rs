//! Questions over time on a page: observations at each instant, and the answers that follow them.
//!
//! In: the built binary, programs. Out: numbers of answers. Invariant: an expected number is that of the published umbrella world,
//! or is worked out by hand.

use crate::serve::{Server, browsed, example, exported};
use serde_json::{Value, json};

/// The umbrella world of Russell and Norvig, *Artificial Intelligence*, with names of its own.
fn weather(question: &str) -> String {
    format!(
        "program Weather {{ parameters {{ hit : probability = 0.9; }} variables {{ Rain, Rain^-1, Wet : bool; }}
            decomposition {{ P(Rain^-1) P(Rain | Rain^-1) P(Wet | Rain) }}
            forms {{
                P(Rain^-1) = previous(Rain) else bernoulli(0.5);
                P(Rain | Rain^-1) = bernoulli(if Rain^-1 {{ 0.7 }} else {{ 0.3 }});
                P(Wet | Rain) = bernoulli(if Rain {{ hit }} else {{ 0.2 }});
            }}
            question rain {{ {question} P(Rain | Wet) }} }}"
    )
}

fn last(rows: &Value) -> f64 {
    rows.as_array().unwrap().last().unwrap()["figure"]["p"].as_f64().unwrap()
}

#[test]
fn the_server_answers_over_time() {
    let server = Server::of(&example("dice.bp"));
    let ask = |question: &str, instants: Value, values: Value| {
        let text = weather(question);
        let (status, answers) = server
            .post("/ask", &json!({ "text": text, "question": 0, "values": values, "instants": instants }));
        assert_eq!(status, 200, "{answers}");
        answers[0].clone()
    };
    // 0.883 in the book; the last instant of the smoother is that of the filter.
    let both = json!([{ "Wet": 1 }, { "Wet": 1 }]);
    for question in ["filter", "smooth"] {
        let answer = ask(question, both.clone(), json!({}));
        assert!((last(&answer["rows"]) - 0.883_357_041_251_778).abs() < 1e-12, "{answer}");
    }
    // What is not observed is predicted: 0.7 · 9/11 + 0.3 · 2/11.
    let answer = ask("filter", json!([{ "Wet": 1 }, {}]), json!({}));
    assert!((last(&answer["rows"]) - 6.9 / 11.0).abs() < 1e-12, "{answer}");
    // With hit = 0.2 the observation says nothing.
    let answer = ask("filter", both, json!({ "hit": 0.2 }));
    assert!((last(&answer["rows"]) - 0.5).abs() < 1e-12, "{answer}");
    let answer = ask("filter", json!([{ "Wet": 7 }]), json!({}));
    assert!(answer["error"].as_str().unwrap().contains("`Wet`"), "{answer}");
}

#[test]
fn observations_over_time_are_set_on_the_pages() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("weather.bp");
    for question in ["filter", "predict(1)", "smooth"] {
        std::fs::write(&file, weather(question)).unwrap();
        let served = Server::of(&file);
        let page = exported(&file, &[], folder.path());
        for address in [format!("http://127.0.0.1:{}/", served.port), format!("file://{}", page.display())] {
            let Some(found) = browsed("instants.cjs", &address, &[]) else { return };
            assert_eq!(found["errors"], json!([]));
            assert_eq!((&found["first"], &found["last"]), (&json!(4), &json!(2)), "{found}");
            let number = |key: &str| found[key].as_str().unwrap().parse::<f64>().unwrap();
            let (two, none) = match question {
                // One instant further: 0.3 + 0.4 p.
                "predict(1)" => (0.3 + 0.4 * 0.883_357, 0.3 + 0.4 * 6.9 / 11.0),
                _ => (0.883_357, 6.9 / 11.0),
            };
            assert!((number("two") - two).abs() < 2e-6 && (number("none") - none).abs() < 2e-6, "{found}");
            assert_eq!(found["faults"].as_array().map_or(0, Vec::len), 0, "{found}");
        }
    }
}
