// The pyramid: a cell of one level from the 4 x 4 cells below it.

struct Raise {
    axis: u32,
    // The level that is made.
    level: u32,
    rows: u32,
    rows_below: u32,
}

@group(0) @binding(1) var<storage, read_write> cells: array<u32>;
@group(0) @binding(2) var<uniform> raise_to: Raise;

@compute @workgroup_size(64)
fn raise(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
         @builtin(local_invocation_index) local: u32) {
    let i = thread_index(group, groups, local, 64u);
    let above = frame.cells[3u * raise_to.axis + raise_to.level];
    let below = frame.cells[3u * raise_to.axis + raise_to.level + 1u];
    if i >= above.y * raise_to.rows {
        return;
    }
    var cell = vec4u(0u);
    for (var child = 0u; child < 16u; child++) {
        let column = 4u * (i % above.y) + child % 4u;
        let row = 4u * (i / above.y) + child / 4u;
        if column < below.y && row < raise_to.rows_below {
            let at = 4u * (below.x + row * below.y + column);
            cell = vec4u(max(cell.x, cells[at]), max(cell.y, cells[at + 1u]),
                cell.z | cells[at + 2u], cell.w | cells[at + 3u]);
        }
    }
    let at = 4u * (above.x + i);
    cells[at] = cell.x;
    cells[at + 1u] = cell.y;
    cells[at + 2u] = cell.z;
    cells[at + 3u] = cell.w;
}
