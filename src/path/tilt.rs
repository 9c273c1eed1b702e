//! The directions over N_s by their definition: longitudes and cotangents in f64, where [`crate::scene::tilt`] shears
//! vectors.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};

use glam::{DQuat, DVec3};

/// Angles between the normals below this are none.
const LEAST: f64 = 1e-6;

/// ω_s and dω_s/dω of the unit direction `w` at unit normals N_s and N_g; see [`crate::scene::tilt`].
pub(super) fn to_shading(n_s: DVec3, n_g: DVec3, w: DVec3) -> (DVec3, f64) {
    let cross = n_s.cross(n_g);
    let theta = cross.length().atan2(n_s.dot(n_g));
    if theta < LEAST {
        return (w, 1.0);
    }
    let axis = cross.normalize();
    let longitude = w.dot(axis.cross(n_s)).atan2(w.dot(n_s));
    // Of the direction and its opposite, the one over N_g: the map is odd.
    let over = if (longitude - theta).cos() > 0.0 { longitude } else { longitude - PI.copysign(longitude) };
    let m = if theta < FRAC_PI_6 { 3.0 * theta } else { FRAC_PI_2 };
    let cot = |angle: f64| angle.tan().recip();
    // The distances of both horizons and of the direction from a_0, away from N_s.
    let [horizon_s, horizon_g, distance] =
        if over > 0.0 { [m, m + theta, over - (FRAC_PI_2 - m)] } else { [m, m - theta, -over - (FRAC_PI_2 - m)] };
    if distance <= 0.0 {
        return (w, 1.0);
    }
    let cot_s = cot(distance) - cot(horizon_g) + cot(horizon_s);
    let distance_s = 1.0_f64.atan2(cot_s);
    let turned = (distance_s - distance) * 1.0_f64.copysign(over);
    (DQuat::from_axis_angle(axis, turned) * w, (distance_s.sin() / distance.sin()).powi(2))
}
