//! How a small robot turns: the mean speed for each direction and nearness of an object, for three behaviours.
//!
//! One specification; only the data differ: pushing turns towards the object, avoiding away, following alongside.
//! Writes `target/gallery/khepera.png`. Lebeltel et al. (2004); chapter 4 of Bessière et al. (2013).

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

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut answer = driver::turn::Outputs::<f64>::default();
    driver::turn::run(&driver::turn::Inputs {}, &mut answer)?;
    // By [Behaviour][Dir][Prox][Vrot].
    let mean = |context: usize| -> f64 {
        (0..21).map(|speed| (speed as f64 - 10.0) * answer.p_vrot[21 * context + speed]).sum()
    };
    let surface = |behaviour: usize| (0..336).map(|place| mean(behaviour * 336 + place)).collect();
    let panels: [(&str, Vec<f64>); 3] =
        [("pushing", surface(0)), ("following", surface(1)), ("avoiding", surface(2))];
    println!("{}", plots::heat_maps("khepera", &panels, ("Dir", -10, 10), ("Prox", 0, 15))?.display());

    let at = |panel: usize, dir: i32, prox: usize| panels[panel].1[(dir + 10) as usize * 16 + prox];
    println!("an object on the right, near: push {:.2}, avoid {:.2}", at(0, 8, 15), at(2, 8, 15));
    assert!(at(0, 8, 15) > 5.0 && (at(0, 8, 15) + at(2, 8, 15)).abs() < 1e-12);
    assert!(at(0, 8, 15) > at(0, 8, 0), "the nearer the object, the surer the hand");
    Ok(())
}
