//! Components, closedness, volumes and winding numbers of meshes whose answers are known.

mod support;

use glam::{DVec3, Vec3};
use rayward_trace::Topology;
use rayward_trace::topology::{NO_COMPONENT, Orientation};
use support::Random;
use support::meshes::{self, Mesh};

/// The same triangles, each with corners of its own.
fn unshared(mesh: &Mesh) -> Mesh {
    let positions: Vec<Vec3> = mesh
        .indices
        .iter()
        .flat_map(|&t| t.map(|i| mesh.triangles().vertex(i)))
        .collect();
    let indices = (0..mesh.indices.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    Mesh::new(&mesh.name, &positions, indices)
}

fn turned(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    for t in &mut mesh.indices {
        t.swap(1, 2);
    }
    mesh
}

#[test]
fn a_sphere_is_closed_with_its_volume() {
    let sphere = meshes::icosphere(4);
    for mesh in [
        sphere.clone(),
        unshared(&sphere),
        sphere.placed(1.0, Vec3::new(1e3, -1e3, 5e2)),
    ] {
        let topology = Topology::analyse(&mesh.triangles());
        let [component] = topology.components[..] else {
            panic!("{:?}", topology.components)
        };
        assert_eq!(component.triangles, mesh.indices.len());
        assert!(component.closed);
        assert_eq!(component.orientation(), Some(Orientation::Outward));
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!(
            (component.signed_volume / exact - 1.0).abs() < 0.01,
            "{}",
            component.signed_volume
        );
    }
    let topology = Topology::analyse(&turned(&sphere).triangles());
    assert_eq!(topology.components[0].orientation(), Some(Orientation::Inward));
}

#[test]
fn negative_zero_is_zero() {
    let mut mesh = unshared(&meshes::icosphere(2));
    let mut zeros = 0;
    for (i, x) in mesh.x.iter_mut().enumerate() {
        if *x == 0.0 {
            *x = if i % 2 == 0 { 0.0 } else { -0.0 };
            zeros += 1;
        }
    }
    assert!(zeros > 10);
    let topology = Topology::analyse(&mesh.triangles());
    assert!(topology.components.len() == 1 && topology.components[0].closed);
}

#[test]
fn holes_wrong_turns_and_third_faces_open_only_their_component() {
    let sphere = meshes::icosphere(2);
    let mut hole = sphere.clone();
    hole.indices.remove(17);
    let mut turned_one = sphere.clone();
    turned_one.indices[40].swap(0, 1);
    let mut fin = sphere.clone();
    fin.indices.push([fin.indices[3][0], fin.indices[3][1], 60]);
    for bad in [hole, turned_one, fin] {
        let both = bad.placed(1.0, Vec3::X * 5.0).and(&sphere);
        let topology = Topology::analyse(&both.triangles());
        assert_eq!(topology.components.len(), 2);
        assert_eq!(
            topology.components.iter().map(|c| c.closed).collect::<Vec<_>>(),
            [false, true]
        );
        assert_eq!(topology.components[0].orientation(), None);
        assert_eq!(topology.component_of_triangle[0], 0);
        assert_eq!(topology.component_of_triangle[both.indices.len() - 1], 1);
        let listed = topology.triangles_of(1);
        assert_eq!(listed.first().copied(), Some(bad.indices.len() as u32));
        assert_eq!(listed.len(), sphere.indices.len());
        assert_eq!(
            topology.components[0].min,
            both.positions()[..162].iter().copied().fold(Vec3::MAX, Vec3::min)
        );
    }
}

#[test]
fn triangles_without_extent_are_left_out() {
    let mut mesh = meshes::icosphere(1);
    let last = mesh.indices.len();
    mesh.indices.push([0, 0, 1]);
    mesh.indices.push([3, 4, 4]);
    mesh.x.push(f32::NAN);
    mesh.y.push(0.0);
    mesh.z.push(0.0);
    mesh.indices.push([0, 1, mesh.x.len() as u32 - 1]);
    let topology = Topology::analyse(&mesh.triangles());
    assert_eq!(topology.component_of_triangle[last..], [NO_COMPONENT; 3]);
    assert!(topology.components.len() == 1 && topology.components[0].closed);
    let empty = meshes::empty();
    assert!(Topology::analyse(&empty.triangles()).components.is_empty());
}

#[test]
fn winding_numbers_tell_inside_from_outside() {
    let mut random = Random::new(3);
    let outer = meshes::blob(3);
    let inner = meshes::icosphere(2).placed(0.3, Vec3::ZERO);
    let room = turned(&outer);
    for (mesh, sign) in [(outer.clone().and(&inner), 1), (room, -1)] {
        let topology = Topology::analyse(&mesh.triangles());
        for _ in 0..300 {
            // The blob is star-shaped: along a vertex's direction it ends at the vertex.
            let vertex = outer.positions()[random.below(outer.x.len())].as_dvec3();
            let share = f64::from(random.unit()) * 1.9;
            let expected = if share < 1.0 { sign } else { 0 };
            if (share - 1.0).abs() > 1e-6 {
                assert_eq!(
                    topology.winding_number(&mesh.triangles(), 0, vertex * share),
                    expected,
                    "{vertex} {share}"
                );
            }
        }
        assert_eq!(
            topology.winding_number(&mesh.triangles(), 0, DVec3::splat(10.0)),
            0
        );
    }
    let both = outer.and(&inner);
    let topology = Topology::analyse(&both.triangles());
    assert_eq!(
        topology.winding_number(&both.triangles(), 1, DVec3::splat(0.1)),
        1
    );
    assert_eq!(
        topology.winding_number(&both.triangles(), 1, DVec3::splat(0.2)),
        0
    );
}

#[test]
fn update_follows_moved_vertices() {
    let sphere = meshes::icosphere(3);
    let mut topology = Topology::analyse(&sphere.triangles());
    let moved = sphere.placed(2.0, Vec3::new(7.0, 0.0, 0.0));
    topology.update(&moved.triangles());
    assert_eq!(topology, Topology::analyse(&moved.triangles()));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let mesh = meshes::blob(6).and(&meshes::soup(5, 5000, 0.1));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| Topology::analyse(&mesh.triangles()))
    };
    assert_eq!(with(1), with(2));
    assert_eq!(with(1), with(5));
}
