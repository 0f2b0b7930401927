// A perspective grid (HM08, 5.1 and 5.2): triangles flattened by a vantage, counted into cells, filled in and sorted by
// depth. One thread a row of a flat triangle. A cell has all that comes within REACH of it.

struct Grid {
    // Of each face.
    columns: u32,
    // Rows of all plates together.
    rows: u32,
    plates: u32,
    // Of all faces.
    cells: u32,
}

// 40 bytes.
struct Plate {
    ax: f32,
    ay: f32,
    bx: f32,
    by: f32,
    cx: f32,
    cy: f32,
    // All of it lies at least as deep.
    depth: f32,
    prim: u32,
    // First cell of the face.
    first: u32,
    row: u32,
}

@group(0) @binding(1) var<uniform> grid: Grid;
@group(0) @binding(2) var<storage, read> plates: array<Plate>;
// First row of each plate among all rows.
@group(0) @binding(3) var<storage, read> row_starts: array<u32>;
// Entries of each cell so far, then where its next one goes.
@group(0) @binding(4) var<storage, read_write> next: array<atomic<u32>>;
// Triangle and depth.
@group(0) @binding(5) var<storage, read_write> entries: array<vec2u>;
@group(0) @binding(6) var<storage, read> cell_starts: array<u32>;

// Cells of a row of a plate, from the first to before the second.
fn cells_of(plate: Plate, row: u32) -> vec2u {
    let lines = vec2f(f32(row) - REACH, f32(row) + 1.0 + REACH);
    let a = vec2f(plate.ax, plate.ay);
    let b = vec2f(plate.bx, plate.by);
    let c = vec2f(plate.cx, plate.cy);
    var range = vec2f(1e30, -1e30);
    range = spanned(range, a, b, lines);
    range = spanned(range, b, c, lines);
    range = spanned(range, c, a, lines);
    let end = f32(grid.columns);
    if range.x > range.y || range.y < -REACH || range.x > end + REACH {
        return vec2u(0u);
    }
    let ends = vec2u(clamp(range + vec2f(-REACH, REACH), vec2f(0.0), vec2f(end - 1.0)));
    return vec2u(ends.x, ends.y + 1u) + plate.first + row * grid.columns;
}

@compute @workgroup_size(64)
fn count(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
         @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= grid.rows {
        return;
    }
    let at = owner(item, grid.plates);
    let cells = cells_of(plates[at], plates[at].row + item - row_starts[at]);
    for (var cell = cells.x; cell < cells.y; cell++) {
        atomicAdd(&next[cell], 1u);
    }
}

@compute @workgroup_size(64)
fn fill(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
        @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= grid.rows {
        return;
    }
    let at = owner(item, grid.plates);
    let plate = plates[at];
    let cells = cells_of(plate, plate.row + item - row_starts[at]);
    for (var cell = cells.x; cell < cells.y; cell++) {
        entries[atomicAdd(&next[cell], 1u)] = vec2u(plate.prim, bitcast<u32>(plate.depth));
    }
}

fn load(at: u32) -> vec2u {
    return entries[at];
}

fn store(at: u32, entry: vec2u) {
    entries[at] = entry;
}

fn before(a: vec2u, b: vec2u) -> bool {
    let depths = vec2f(bitcast<f32>(a.y), bitcast<f32>(b.y));
    return depths.x < depths.y || (depths.x == depths.y && a.x < b.x);
}

// Each cell's entries by depth, then triangle.
@compute @workgroup_size(64)
fn order(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
         @builtin(local_invocation_index) local: u32) {
    let cell = thread_index(group, groups, local, 64u);
    if cell >= grid.cells {
        return;
    }
    let first = cell_starts[cell];
    let count = cell_starts[cell + 1u] - first;
    if count <= LONGEST {
        shell_sort(first, count);
    }
}
