// Hits of triangles, or the word that f32 cannot tell.

// A sample whose plane stays farther than this from the ray within its texel is not crossed: 1/127 for its slopes,
// the plane's own error, and the errors of coverage and walk.
const PLANE_SLACK: f32 = 0.0625;

// The triangles tested last, so that one over several texels is not tested in each.
fn seen(mailbox: ptr<function, vec4u>, prim: u32) -> bool {
    if any(*mailbox == vec4u(prim)) {
        return true;
    }
    *mailbox = vec4u(prim, (*mailbox).xyz);
    return false;
}

@compute @workgroup_size(64)
fn trace_exact(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
               @builtin(local_invocation_index) local: u32) {
    let index = thread_index(group, groups, local, 64u);
    if index >= query.rays {
        return;
    }
    let ray = rays[index];
    let order = axis_order(ray.dir);
    var best = Best(Verdict(MISS, FAR, FAR), NONE, FAR);
    var mailbox = vec4u(NONE);
    var steps = vec3u(0u);
    var tests = 0u;
    var t_end = ray.end;
    for (var i = 0u; i < 3u && !settled(best); i++) {
        var w = walk_start(ray, order[i], steps);
        while !settled(best) && walk_next(&w, t_end, REACH) {
            for (var s = w.first; s < w.last; s++) {
                let id = samples[SAMPLE * s];
                let slopes = samples[SAMPLE * s + 2u];
                let off = above(w, bitcast<f32>(samples[SAMPLE * s + 1u]), slopes_of(slopes));
                let passes = min(off.x, off.y) > PLANE_SLACK || max(off.x, off.y) < -PLANE_SLACK;
                if id == ray.skip || id == best.prim || (passes && slopes != NO_PLANE) || seen(&mailbox, id) {
                    continue;
                }
                tests += 1u;
                if improve(&best, meet(ray, id, w.ends.x), id) {
                    t_end = min(t_end, best.verdict.high);
                }
            }
        }
        steps = w.steps;
    }
    let t = 0.5 * (best.verdict.low + best.verdict.high);
    found[index] = Found(t, best.prim, state_of(best), steps.x, steps.y, steps.z, tests, 0u);
}
