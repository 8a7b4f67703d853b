//! The rigid sphere as a head: its response to a point source, near or far.
//!
//! In: radius of the head, distance and direction of a source. Out: impulse responses of ears at both ends of the
//! lateral axis. Invariant: the responses depend only on the distance and on the lateral angle of the source.
//!
//! R. O. Duda and W. L. Martens, *Range dependence of the response of a spherical head model*, JASA 104, 1998. The
//! pressure at a point of the surface, relative to that of the free field at the centre of the head, is
//!
//! ```text
//! H(ρ, μ, θ) = −(ρ/μ) exp(−iμρ) Σ_m (2m + 1) P_m(cos θ) h_m(μρ) / h_m'(μ)      ρ = r/a, μ = 2πf a/c
//! ```
//!
//! with θ the angle between the source and the point, and h_m the spherical Hankel function of the first kind (time as
//! exp(−iωt)). The series is summed with ratios of neighbouring h_m, which neither overflow nor vanish.

use nalgebra::Complex;
use std::f64::consts::TAU;

/// Speed of sound, m/s.
pub const SOUND_SPEED_M_S: f64 = 343.0;
/// Default radius of the head, m.
pub const HEAD_RADIUS_M: f64 = 0.0875;
/// The nearest source, in radii of the head.
pub const NEAREST_RADII: f64 = 1.15;
/// Most terms of the series.
const MOST_TERMS: usize = 2000;
/// Terms below this, relative to the sum, end the series.
const NEGLIGIBLE: f64 = 1e-12;
/// Time before the sound would reach the centre of the head, in a response, s.
const LEAD_S: f64 = 1e-3;

/// H(ρ, μ, θ) for several points of the surface, given by cos θ.
pub fn transfer(rho: f64, mu: f64, cosines: [f64; 2]) -> [Complex<f64>; 2] {
    let i = Complex::new(0.0, 1.0);
    let (near, far) = (mu, mu * rho);
    // h_m(μρ) / h_m(μ), and h_m / h_{m-1} at each of the two arguments.
    let mut quotient = (i * (far - near)).exp() / rho;
    let [mut at_near, mut at_far] = [near, far].map(|x| 1.0 / x - i);
    let mut sums = [Complex::default(); 2];
    let mut legendre = [[0.0, 1.0]; 2];
    let mut small = 0;
    for m in 0..MOST_TERMS {
        let order = m as f64;
        // h_m'(x) / h_m(x) = h_{m-1}(x) / h_m(x) − (m + 1) / x, and i − 1/x for m = 0.
        let derivative = if m == 0 { i - 1.0 / near } else { 1.0 / at_near - (order + 1.0) / near };
        let factor = (2.0 * order + 1.0) * quotient / derivative;
        for ((sum, p), cosine) in sums.iter_mut().zip(&mut legendre).zip(cosines) {
            *sum += factor * p[1];
            *p = [p[1], ((2.0 * order + 1.0) * cosine * p[1] - order * p[0]) / (order + 1.0)];
        }
        let reach = sums.iter().map(|sum| sum.norm()).fold(f64::MIN_POSITIVE, f64::max);
        small = if factor.norm() < NEGLIGIBLE * reach { small + 1 } else { 0 };
        if small == 3 {
            break;
        }
        if m > 0 {
            [at_near, at_far] =
                [(near, at_near), (far, at_far)].map(|(x, ratio)| (2.0 * order + 1.0) / x - 1.0 / ratio);
        }
        quotient *= at_far / at_near;
    }
    let scale = -(rho / mu) * (-i * far).exp();
    sums.map(|sum| scale * sum)
}

/// The impulse responses `[left, right]` at a sampling rate in Hz, of a head of a radius in metres, to a source at a
/// distance in metres (at least [`NEAREST_RADII`] radii), with `sine` the sine of its lateral angle, positive to the
/// left. Each response is relative to the free field at the centre of the head and begins 1 ms before the sound would
/// arrive there.
pub fn responses(radius_m: f64, distance_m: f64, sine: f64, rate_hz: f64) -> [Vec<f64>; 2] {
    let rho = (distance_m / radius_m).max(NEAREST_RADII);
    let taps = ((6e-3 * rate_hz).ceil() as usize).next_multiple_of(2);
    let lead = (LEAD_S * rate_hz).round();
    let mut found = [vec![0.0; taps], vec![0.0; taps]];
    for bin in 0..=taps / 2 {
        let frequency = bin as f64 * rate_hz / taps as f64;
        let mu = TAU * frequency.max(0.1) * radius_m / SOUND_SPEED_M_S;
        // The last bin, of a period of two samples, has a real part only.
        let share = if bin == 0 || bin == taps / 2 { 1.0 } else { 2.0 } / taps as f64;
        // Time as exp(+iωt) in what follows.
        let spectra = transfer(rho, mu, [sine, -sine]).map(|value| value.conj());
        for (spectrum, response) in spectra.iter().zip(&mut found) {
            for (n, value) in response.iter_mut().enumerate() {
                let turns = (bin as f64 * (n as f64 - lead)).rem_euclid(taps as f64) / taps as f64;
                let (im, re) = (TAU * turns).sin_cos();
                *value += share * (spectrum.re * re - spectrum.im * im);
            }
        }
    }
    found
}
