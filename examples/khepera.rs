//! The turning speed of a robot for each direction and proximity of an object, for three behaviours.
//!
//! One specification with different data: pushing turns towards the object, avoiding away from it, following alongside
//! it. Writes `target/gallery/khepera.png`. Lebeltel et al. (2004); chapter 4 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_macros::bayesian_program;

bayesian_program! {
    program Driver {
        variables { Behaviour : { Pushing, Following, Avoiding }; Dir : -10..=10; Prox : 0..=15; Vrot : -10..=10; }
        decomposition { P(Behaviour) P(Dir) P(Prox) P(Vrot | Behaviour Dir Prox) }
        forms {
            P(Behaviour) = uniform;
            P(Dir) = uniform;
            P(Prox) = uniform;
            P(Vrot | Behaviour Dir Prox) = match Behaviour {
                Pushing => normal(Dir, 18 - Prox),
                Following => normal(0.25 * (18 - Prox) * (if Dir > 0 { Dir - 10 } else { Dir + 10 }), 18 - Prox),
                Avoiding => normal(-Dir, 18 - Prox)
            };
        }
        question turn { P(Vrot | Behaviour Dir Prox) }
    }
}

use driver::Behaviour;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let answer = driver::turn().ask()?;
    let mean = |behaviour: Behaviour, dir: i64, prox: i64| -> f64 {
        (-10..=10).map(|speed| speed as f64 * answer.p(speed, behaviour, dir, prox)).sum()
    };
    let surface = |behaviour: Behaviour| {
        (-10..=10)
            .flat_map(|dir| (0..=15).map(move |prox| (dir, prox)))
            .map(|(dir, prox)| mean(behaviour, dir, prox))
            .collect()
    };
    let panels: [(&str, Vec<f64>); 3] = [
        ("pushing", surface(Behaviour::Pushing)),
        ("following", surface(Behaviour::Following)),
        ("avoiding", surface(Behaviour::Avoiding)),
    ];
    println!("{}", plots::heat_maps("khepera", &panels, ("Dir", -10, 10), ("Prox", 0, 15))?.display());

    let (push, avoid) = (mean(Behaviour::Pushing, 8, 15), mean(Behaviour::Avoiding, 8, 15));
    println!("an object on the right, near: push {push:.2}, avoid {avoid:.2}");
    assert!(push > 5.0 && (push + avoid).abs() < 1e-12);
    assert!(push > mean(Behaviour::Pushing, 8, 0), "the mean speed grows as the object comes nearer");
    Ok(())
}
