//! The horizon of N_g, which no shading normal gets close to.

use glam::Vec3;

/// The least cosine between N_s and N_g, 87°. Beyond, N_s is lifted: what lies between the horizons would be squeezed
/// into less than directions in f32 can tell apart.
pub const STEEPEST: f32 = 0.05;

/// The unit normal `n` on the side of the unit normal `n_g`, lifted to the cosine [`STEEPEST`] if it lies lower.
#[inline(always)]
pub fn lifted(n: Vec3, n_g: Vec3) -> Vec3 {
    let cos = n.dot(n_g);
    if cos >= STEEPEST { n } else { lift(n, n_g, cos) }
}

#[cold]
#[inline(never)]
fn lift(n: Vec3, n_g: Vec3, cos: f32) -> Vec3 {
    let Some(horizontal) = (n - n_g * cos).try_normalize() else { return n_g };
    (horizontal * (1.0 - STEEPEST * STEEPEST).sqrt() + n_g * STEEPEST).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_at_the_horizon_is_lifted() {
        for n in [Vec3::X, Vec3::new(0.999, 0.0, 0.01).normalize(), Vec3::new(0.8, 0.0, -0.6)] {
            let lifted = lifted(n, Vec3::Z);
            assert!((lifted.z - STEEPEST).abs() < 1e-6 && lifted.y == 0.0 && lifted.x > 0.99, "{lifted}");
        }
        assert_eq!(lifted(Vec3::new(0.6, 0.0, 0.8), Vec3::Z), Vec3::new(0.6, 0.0, 0.8));
    }
}
