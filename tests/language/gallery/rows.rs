//! Programs whose sets are the rows of tables.
//!
//! In: a program of the gallery, and its table. Out: posteriors. Invariant: expected numbers are those of the normal equations,
//! solved in exact fractions outside.

use super::folder;
use bp_core::prelude::*;

#[test]
fn pupils_of_schools() {
    let open = || Program::open(folder().join("pupils.bp"))?.rows(folder().join("data/pupils.csv"));
    let pupils = open().unwrap_or_else(|error| panic!("{error}"));
    let near = |found: &Posterior, mean: f64, deviation: f64| {
        let [mine, own] = [found.mean().unwrap(), found.deviation().unwrap()];
        assert!((mine - mean).abs() < 1e-9 && (own - deviation).abs() < 1e-9, "{mine} ± {own}");
    };
    near(&pupils.ask("effect").unwrap(), 2.750_498_194_437_285, 0.272_624_920_564_734_86);
    let levels = pupils.ask("schools").unwrap();
    let expected = [
        ("Level[Hill]", 61.300_864_868_918_53, 1.878_972_320_963_287),
        ("Level[Lake]", 55.229_550_213_310_73, 2.118_195_688_155_591),
        ("Level[Park]", 57.551_754_920_392_11, 1.712_102_633_903_365_1),
        ("Level[Mill]", 66.353_620_842_806_4, 2.747_561_744_650_931_7),
    ];
    expected.iter().for_each(|(name, mean, deviation)| near(&levels.of(name).unwrap(), *mean, *deviation));
    // Two pupils were ill on the day, one has not been marked yet.
    let missing = pupils.missing().unwrap();
    let expected = [
        ("P(Mark[7])", 67.881_841_907_722_25, 5.293_018_351_850_94),
        ("P(Mark[19])", 82.754_750_785_529_35, 5.307_734_115_386_039),
        ("P(Mark[33])", 58.651_954_198_167_026, 5.264_943_958_995_105),
    ];
    assert_eq!(missing.len(), expected.len());
    for (found, (question, mean, deviation)) in missing.iter().zip(expected) {
        assert_eq!(found.question(), question);
        near(found, mean, deviation);
    }
}
