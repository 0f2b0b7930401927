// Rows of triangles over a raster, for the cube and for grids.

// Extends a range by an edge's part between two lines v = const.
fn spanned(range: vec2f, a: vec2f, b: vec2f, lines: vec2f) -> vec2f {
    let low = min(a.y, b.y);
    let high = max(a.y, b.y);
    if high < lines.x || low > lines.y {
        return range;
    }
    let rise = b.y - a.y;
    var u = vec2f(a.x, b.x);
    if rise != 0.0 {
        let v = clamp(lines, vec2f(low), vec2f(high));
        u = a.x + (b.x - a.x) * clamp((v - a.y) / rise, vec2f(0.0), vec2f(1.0));
    }
    return vec2f(min(range.x, min(u.x, u.y)), max(range.y, max(u.x, u.y)));
}

// Which of so many a row belongs to: the last whose first row, in `row_starts`, is at or before it.
fn owner(row: u32, count: u32) -> u32 {
    var low = 0u;
    var high = count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if row_starts[middle] <= row {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}
