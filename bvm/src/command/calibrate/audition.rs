//! `bvm calibrate audition`: the cues of a head.
//!
//! In: measured responses (SOFA), or a rigid sphere. Out: `head.json`, which `bvm listen` and `bvm synth` read.
//! Invariant: a head whose time differences contradict its azimuths is refused, or mirrored on request.

use super::super::print;
use bvm::audition::{AuditionError, Calibration, Head, Origin, Responses, checksum, sofa, sphere};
use bvm::error::Error;
use bvm::report::write_atomically;
use clap::Args;
use std::path::PathBuf;

/// Calibrate hearing: the cues of each direction and band.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  bvm calibrate audition --hrir KEMAR.sofa --out head.json\n  bvm calibrate audition --sphere --out head.json\n\n\
Differences are positive when the left ear leads or is louder; azimuth is\n\
counter-clockwise, positive to the left."
)]
pub(crate) struct Audition {
    /// Head-related impulse responses (SOFA, free field).
    #[arg(long, value_name = "FILE", required_unless_present = "sphere", conflicts_with = "sphere")]
    hrir: Option<PathBuf>,
    /// A rigid sphere instead of a measured head.
    #[arg(long)]
    sphere: bool,
    /// Radius of the sphere, m.
    #[arg(long, value_name = "M", default_value_t = sphere::HEAD_RADIUS_M, requires = "sphere")]
    radius: f64,
    /// The file counts azimuth clockwise: mirror it.
    #[arg(long, requires = "hrir")]
    mirror: bool,
    /// Output file.
    #[arg(long, value_name = "FILE", default_value = "head.json")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Audition) -> Result<(), Error> {
    let (head, origin) = match &arguments.hrir {
        Some(path) => {
            let (responses, bytes) = sofa::read(path)?;
            let head = if arguments.mirror { responses.mirrored() } else { responses };
            let file = path.display().to_string();
            (
                Head::Measured(head),
                Origin::Sofa { file, checksum: checksum(&bytes), mirrored: arguments.mirror },
            )
        }
        None if !(0.03..=0.3).contains(&arguments.radius) => {
            let reason = format!("a head of {} m: expected a radius of 0.03 to 0.3 m", arguments.radius);
            return Err(AuditionError::Head(reason).into());
        }
        None => (Head::Sphere(arguments.radius), Origin::Sphere { radius_m: arguments.radius }),
    };
    let calibration = Calibration::of(&head, origin).map_err(|error| match (error, &arguments.hrir) {
        (Error::Audition(AuditionError::Head(reason)), Some(path)) => {
            AuditionError::File { path: path.clone(), reason }.into()
        }
        (error, _) => error,
    })?;
    write_atomically(&arguments.out, calibration.text().as_bytes())?;
    if let Head::Measured(Responses { rate_hz, measured }) = &head {
        print(&format!("head          {} directions, {rate_hz} Hz", measured.len()));
    }
    print(&format!("largest ITD   {:.0} µs", calibration.largest_itd_us()));
    print(&format!("wrote {}", arguments.out.display()));
    Ok(())
}
