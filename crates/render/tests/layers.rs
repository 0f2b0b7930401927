//! Layers besides the colour that are made of more than one look: motion and costs.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use rayward::scene::{FrameGeometry, PosedCamera, Projection, Scene, builtin};
use rayward::{
    CubeBuilder, Film, Layers, Measure, Moment, NO_ID, RenderOptions, Renderer, Shard, add_motion,
};

fn options(layers: Layers) -> RenderOptions {
    RenderOptions {
        width: 80,
        height: 60,
        layers,
        ..RenderOptions::default()
    }
}

fn film(scene: &Scene, geometry: &FrameGeometry, options: &RenderOptions) -> Film {
    let mut renderer = Renderer::new(scene);
    let camera = &geometry.cameras[0];
    let rendered = renderer.render(geometry, camera, &geometry.lights, options, &|_| ());
    rendered.expect("valid input").film
}

/// Half the picture's height at a depth of 1.
fn half(camera: &PosedCamera) -> f64 {
    match camera.projection {
        Projection::Perspective { vfov, .. } => (0.5 * vfov).tan(),
        Projection::Orthographic { .. } => panic!("a perspective camera"),
    }
}

#[test]
fn what_stands_still_has_no_motion() {
    let scene = builtin::build("walker").expect("it exists");
    let geometry = scene.at(0.4);
    let mut film = film(&scene, &geometry, &options(Layers::ALL));
    let now = Moment {
        geometry: &geometry,
        camera: &geometry.cameras[0],
    };
    add_motion(&mut film, now, now).expect("it has what it takes");
    assert!(film.layers().motion);
    assert!(
        film.motion
            .iter()
            .all(|motion| motion.x == 0.0 && motion.y == 0.0)
    );
    let earlier = scene.at(0.36);
    let before = Moment {
        geometry: &earlier,
        camera: &geometry.cameras[0],
    };
    add_motion(&mut film, now, before).expect("it has what it takes");
    let moving = film.motion.iter().filter(|motion| motion.length() > 0.05).count();
    let walker = film.prim.iter().filter(|&&prim| prim != NO_ID).count();
    assert!(moving > 20 && moving < walker, "{moving} of {walker} pixels");
}

#[test]
fn motion_is_to_the_right_and_down_in_pixels() {
    let scene = builtin::build("blob-1k").expect("it exists");
    let geometry = scene.at(0.0);
    let camera = &geometry.cameras[0];
    let mut film = film(&scene, &geometry, &options(Layers::ALL));
    let right = camera.forward.cross(camera.up).normalize();
    let up = right.cross(camera.forward);
    let now = Moment {
        geometry: &geometry,
        camera,
    };
    let mut check = |before: PosedCamera, surface: &dyn Fn(f64) -> [f64; 2], beyond: Option<[f64; 2]>| {
        let before = Moment {
            geometry: &geometry,
            camera: &before,
        };
        add_motion(&mut film, now, before).expect("it has what it takes");
        let mut seen = [0; 2];
        for (pixel, motion) in film.motion.iter().enumerate() {
            let known = film.prim[pixel] != NO_ID;
            seen[usize::from(known)] += 1;
            let want = if known {
                Some(surface(f64::from(film.depth[pixel])))
            } else {
                beyond
            };
            let Some([x, y]) = want else { continue };
            let error = (f64::from(motion.x) - x)
                .abs()
                .max((f64::from(motion.y) - y).abs());
            assert!(error < 2e-3 * (1.0 + x.abs() + y.abs()), "{motion} for {x}, {y}");
        }
        assert!(seen[0] > 100 && seen[1] > 100, "{seen:?}");
    };
    // A camera that has come from the right, or from above, sees everything move to the right, or up: the nearer, the
    // more.
    let scale = 60.0 / (2.0 * half(camera));
    let shifted = |by: DVec3| PosedCamera {
        eye: camera.eye + by,
        ..camera.clone()
    };
    check(
        shifted(right * 0.1),
        &|depth| [0.1 * scale / depth, 0.0],
        Some([0.0; 2]),
    );
    check(
        shifted(up * 0.1),
        &|depth| [0.0, -0.1 * scale / depth],
        Some([0.0; 2]),
    );
    // As it rolls, all turns about the middle of the picture.
    let roll = DQuat::from_axis_angle(camera.forward, 0.01);
    let rolled = PosedCamera {
        up: roll * camera.up,
        ..camera.clone()
    };
    add_motion(
        &mut film,
        now,
        Moment {
            geometry: &geometry,
            camera: &rolled,
        },
    )
    .expect("it has what it takes");
    let at = |x: usize, y: usize| film.motion[y * 80 + x];
    assert!(at(79, 30).y * at(0, 30).y < 0.0 && at(40, 0).x * at(40, 59).x < 0.0);
    assert!((at(79, 30).length() - 39.5 * 0.01).abs() < 1e-2, "{}", at(79, 30));
}

#[test]
fn costs_change_nothing_else() {
    let scene = builtin::build("teapot-mirror").expect("it exists");
    let geometry = scene.at(0.0);
    let plain = film(&scene, &geometry, &options(Layers::ALL));
    assert!(plain.cost.is_empty());
    let all = Layers {
        cost: true,
        ..Layers::ALL
    };
    let mut counted = film(&scene, &geometry, &options(all));
    let cost = counted.cost.clone();
    counted.keep(Layers::ALL);
    assert!(counted == plain);
    let sum = |number: usize| cost.iter().map(|cost| cost.to_array()[number]).sum::<f32>();
    let [nodes, tests, cells, texels, casters, spared] = [0, 1, 2, 3, 4, 5].map(sum);
    assert!(nodes > 0.0 && tests > 0.0 && casters > spared && spared > 0.0);
    assert_eq!([cells, texels], [0.0; 2]);
    // A mirror sends rays on.
    let [mirror, other] = [true, false].map(|mirror| {
        let is = |prim: u32| {
            let object = geometry.objects.iter().find(|o| o.triangles.contains(&prim));
            object.is_some_and(|o| scene.materials[o.material as usize].metallic == 1.0) == mirror
        };
        let of = cost.iter().zip(&plain.prim).filter(|(_, prim)| is(**prim));
        let nodes: Vec<f32> = of.map(|(cost, _)| cost.nodes).collect();
        nodes.iter().sum::<f32>() / nodes.len().max(1) as f32
    });
    assert!(
        mirror > 1.2 * other,
        "{mirror} nodes at mirrors, {other} elsewhere"
    );
}

#[test]
fn costs_of_the_cube_are_its_cells_and_texels() {
    let scene = builtin::build("teapot-mirror").expect("it exists");
    let geometry = scene.at(0.0);
    let mut renderer = Renderer::new(&scene);
    renderer.set_secondary(Arc::new(CubeBuilder::default()));
    let options = options(Measure::Texels.layers());
    let camera = &geometry.cameras[0];
    let mut render = |options: &RenderOptions| {
        let rendered = renderer.render(&geometry, camera, &geometry.lights, options, &|_| ());
        rendered.expect("valid input").film
    };
    let whole = render(&options);
    assert!(whole.cost.iter().all(|cost| cost.nodes == 0.0));
    assert!(
        whole
            .cost
            .iter()
            .any(|cost| cost.cells > 0.0 && cost.texels > 0.0)
    );
    // Those of a part are those of the whole.
    let part = render(&RenderOptions {
        shard: Shard::new(1, 2),
        ..options
    });
    assert!(part.cost[..64] == whole.cost[..64]);
    assert!(part.cost[64..80].iter().all(|cost| cost.texels == 0.0));
}
