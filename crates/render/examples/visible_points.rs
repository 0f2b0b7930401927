//! Which points of a list see a lamp: the structure for a light's shadow rays alone, without cameras and pictures.

use glam::{DVec3, Vec3};
use rayward::trace::{
    Casts, Light, LightGridOptions, PointLightGrid, Receiver, ShadowScratch, SimdLevel, Triangles,
};

fn main() {
    // A square table of 2 m at a height of 1 m, under a lamp.
    let (x, y, z) = ([-1.0, 1.0, 1.0, -1.0], [1.0; 4], [1.0, 1.0, -1.0, -1.0]);
    let indices = [[0, 1, 2], [0, 2, 3]];
    let table = Triangles::new(&x, &y, &z, &indices);
    let lamp = Light::Point(Vec3::new(0.0, 3.0, 0.0));

    let options = LightGridOptions::default();
    let grid = PointLightGrid::build(lamp, table, &|_| Casts::Both, options, SimdLevel::detect());

    let points: Vec<Receiver> = (0..7)
        .map(|i| Receiver::free(DVec3::new(f64::from(i) * 0.5, 0.0, 0.0)))
        .collect();
    let (mut scratch, mut shadow) = (ShadowScratch::default(), Vec::new());
    grid.shadowed(&points, &mut scratch, &mut shadow);
    for (receiver, dark) in points.iter().zip(&shadow) {
        let word = if *dark { "in the shadow" } else { "lit" };
        println!("{} m from the middle of the floor: {word}", receiver.point.x);
    }
}
