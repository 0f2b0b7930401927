// Rays of a vantage: each is answered by the triangles of its cell, front to back.

// 16 bytes.
struct Place {
    cell: u32,
    // Where the ray starts, and how much deeper it is a unit of its parameter further on.
    depth: f32,
    rate: f32,
    pad: u32,
}

@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> entries: array<vec2u>;
@group(0) @binding(9) var<storage, read> places: array<Place>;

fn answer(index: u32, ray: Ray) -> Found {
    let place = places[index];
    var best = Best(Verdict(MISS, FAR, FAR), NONE, FAR);
    var tests = 0u;
    var looked = 0u;
    let first = starts[place.cell];
    let last = starts[place.cell + 1u];
    if ray.end >= 0.0 && last - first > LONGEST {
        // Not in order.
        best.verdict.state = UNSURE;
    } else if ray.end >= 0.0 {
        for (var s = first; s < last && !settled(best); s++) {
            let entry = entries[s];
            let further = place.rate * min(ray.end, best.verdict.high);
            let slack = 1e-5 * (abs(place.depth) + abs(further));
            if bitcast<f32>(entry.y) > place.depth + max(further, 0.0) + slack {
                break;
            }
            looked += 1u;
            if entry.x == ray.skip || entry.x == best.prim {
                continue;
            }
            // A point of the ray near the triangle.
            let t = dot(corner_of(entry.x, 0u) - ray.origin, ray.dir) / dot(ray.dir, ray.dir);
            tests += 1u;
            improve(&best, meet(ray, entry.x, clamp(t, 0.0, ray.end)), entry.x);
        }
    }
    return told(best, vec3u(1u, 0u, looked), tests);
}
