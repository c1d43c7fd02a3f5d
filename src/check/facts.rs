//! What a driver's arithmetic does where Vulkan leaves it free: probed, printed, never relied upon.

use serde::{Deserialize, Serialize};

use crate::check::probe::{Kernel, Operations};
use crate::check::rng::Rng;
use crate::check::{CheckError, Lab, scenes};

/// A fact about a driver.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fact {
    /// What was probed.
    pub name: String,
    /// What was found.
    pub value: String,
}

/// Inputs of the probe of loops: beyond 2^16, where one driver stops.
const LOOP: u32 = 100_000;

/// Probes the device.
///
/// # Errors
/// The device fails.
pub fn facts(lab: &Lab) -> Result<Vec<Fact>, CheckError> {
    let mut rng = Rng::new(1);
    let scene = scenes::room();
    let mut probe = lab.kernel::<[f32; 4], Operations>(&scene, Kernel::OPERATIONS, 1)?;
    let mut out = Vec::new();
    let mut fact = |name: &str, value: String| out.push(Fact { name: name.to_owned(), value });

    // Positive, over ten binades.
    let inputs: Vec<[f32; 4]> = (0..1 << 16)
        .map(|_| std::array::from_fn(|_| (rng.between(1.0, 2.0) * 2f64.powf(rng.between(-5.0, 5.0))) as f32))
        .collect();
    let results = probe.run(&inputs)?;
    let worst = |f: &dyn Fn(&[f64; 3], &Operations) -> f64| {
        inputs.iter().zip(&results).map(|(i, o)| f(&[i[0], i[1], i[2]].map(f64::from), o)).fold(0.0, f64::max)
    };
    let share = |f: &dyn Fn(&[f32; 4], &Operations) -> bool| {
        inputs.iter().zip(&results).filter(|(i, o)| f(i, o)).count() as f64 / inputs.len() as f64
    };
    let ulps = |x: f32, exact: f64| (f64::from(x) - exact).abs() / ulp(exact);
    fact("division, worst error (ulp; Vulkan allows 2.5)", short(worst(&|i, o| ulps(o.quotient, i[0] / i[1]))));
    fact("sqrt (ulp)", short(worst(&|i, o| ulps(o.sqrt, i[0].sqrt()))));
    fact("inversesqrt (ulp; 2)", short(worst(&|i, o| ulps(o.inverse_sqrt, 1.0 / i[0].sqrt()))));
    fact("sin (absolute; 4.9e-4)", short(worst(&|i, o| (f64::from(o.sin) - i[0].sin()).abs())));
    fact("cos (absolute; 4.9e-4)", short(worst(&|i, o| (f64::from(o.cos) - i[0].cos()).abs())));
    fact("exp (ulp)", short(worst(&|i, o| ulps(o.exp, i[0].exp()))));
    fact("log (relative)", short(worst(&|i, o| ((f64::from(o.log) - i[0].ln()) / i[0].ln()).abs())));
    let fused = |i: &[f32; 4]| i[0].mul_add(i[1], i[2]);
    let plain = |i: &[f32; 4]| i[0] * i[1] + i[2];
    let differ = |i: &[f32; 4]| fused(i) != plain(i);
    let of_those = |n: f64| n / share(&|i, _| differ(i)).max(f64::MIN_POSITIVE);
    let fma_fused = of_those(share(&|i, o| differ(i) && o.fma == fused(i)));
    fact("fma() is fused", yes(fma_fused));
    fact("x·y + z is contracted", yes(of_those(share(&|i, o| differ(i) && o.multiply_add == fused(i)))));
    fact(
        "precise x·y + z is contracted",
        yes(of_those(share(&|i, o| differ(i) && o.precise_multiply_add == fused(i)))),
    );

    let special = probe.run(&[
        [1e-30, 1e-10, 0.0, 0.0],
        [f32::NAN, 1.0, 0.0, 0.0],
        [1.0, f32::NAN, 0.0, 0.0],
        [-1.0, 1.0, 0.0, 0.0],
        [1e-40, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0],
    ])?;
    let kept = (special[0].product != 0.0, special[4].product != 0.0);
    fact(
        "denormal results / operands",
        format!("{} / {}", if kept.0 { "kept" } else { "0" }, if kept.1 { "kept" } else { "0" }),
    );
    fact("min(NaN, 1), min(1, NaN)", format!("{}, {}", special[1].min, special[2].min));
    fact("max(NaN, 1), max(1, NaN)", format!("{}, {}", special[1].max, special[2].max));
    fact("uint(−1.0)", special[3].to_uint.to_string());
    fact("0/0", special[5].quotient.to_string());
    fact("normalize(0)", special[5].normalized[0].to_string());

    let mut loops = lab.kernel::<[u32; 4], [u32; 4]>(&scene, Kernel::LOOP, 1)?;
    let counted = loops.run(&[[LOOP, 0, 0, 0]; 8])?;
    let least = counted.iter().map(|c| c[0]).min().unwrap_or(0);
    fact(
        "loop iterations of an invocation",
        if least < LOOP { format!("silently stopped after {least}") } else { format!("at least {LOOP}") },
    );
    fact("lanes of a subgroup", lab.context.info().subgroup_size.to_string());
    Ok(out)
}

/// Spacing of single precision at x.
pub(crate) fn ulp(x: f64) -> f64 {
    let exponent = ((x.abs().to_bits() >> 52) as i32 - 1023).max(-126);
    2f64.powi(exponent - 23)
}

fn short(x: f64) -> String {
    if (0.01..1000.0).contains(&x) { format!("{x:.2}") } else { format!("{x:.1e}") }
}

fn yes(share: f64) -> String {
    match share {
        s if s > 0.999 => "yes".to_owned(),
        s if s < 0.001 => "no".to_owned(),
        s => format!("for {:.1}%", 100.0 * s),
    }
}

#[cfg(test)]
mod tests {
    use super::ulp;

    #[test]
    fn spacing() {
        assert_eq!(ulp(1.0), f64::from(f32::EPSILON));
        assert_eq!(ulp(-1.99), f64::from(f32::EPSILON));
        assert_eq!(ulp(2.0), 2.0 * f64::from(f32::EPSILON));
        assert_eq!(ulp(0.0), f64::from(f32::from_bits(1)));
    }
}
