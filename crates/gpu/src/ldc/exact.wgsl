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

fn answer(index: u32, ray: Ray) -> Found {
    most_rounds = MOST_ROUNDS;
    let order = axis_order(ray.dir);
    var best = Best(Verdict(MISS, FAR, FAR), NONE, FAR);
    var mailbox = vec4u(NONE);
    var steps = vec3u(0u);
    var tests = 0u;
    var t_end = ray.end;
    for (var i = 0u; i < 3u && !settled(best); i++) {
        var w = walk_start(ray, order[i], steps);
        let slack = PLANE_SLACK + depth_error(order[i]);
        while !settled(best) && walk_next(&w, t_end, REACH) {
            var near = near_ray(w, slack + PLANE_REACH);
            for (var sample = next_near(&w, &near); sample.id != NONE; sample = next_near(&w, &near)) {
                let id = sample.id;
                let off = above(w, sample.depth, slopes_of(sample.slopes));
                let passes = min(off.x, off.y) > slack || max(off.x, off.y) < -slack;
                let crossed = !passes || sample.slopes == NO_PLANE;
                if id == ray.skip || id == best.prim || !crossed || seen(&mailbox, id) {
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
    if spent() {
        best.verdict.state = UNSURE;
    }
    return told(best, steps, tests);
}
