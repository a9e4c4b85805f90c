#include "bake/lattice_cells.h"

#include "shade/rays.h"

#include <math.h>

/* A cell is interpolated where a free ball of so many of its spacings touches its middle: what hides the sky
 * from it is farther away than that, or low. */
static const double CLEAR = 1.0;
/* What such a ball may lack of being free, of its radius and in voxels: fields are not better known. */
static const double LACK = 0.25, LACK_VOXELS = 0.25;
/* The corners of a cell differ by at most this. */
static const double RANGE = 0.2;
/* The texels between lie so flat, of the spacing, and their normals within so much (cosine) of each other. */
static const double FLAT = 0.2, ALIKE = 0.95;

bool vshi_lattice_lookup(const vshi_lattice *l, uint32_t column, uint32_t row, size_t *i) {
    const vshi_band *band = &l->texels->band;
    const uint32_t width = (uint32_t)l->texels->info.width, held = row - (uint32_t)band->first;
    if (column >= width || held >= (uint32_t)band->rows) {
        return false;
    }
    const uint32_t number = l->at[(size_t)held * width + column];
    *i = (size_t)number - 1;
    return number != 0;
}

/* Texels of the cell from (column, row) on; false where they are no rectangle. */
static bool clip(const vshi_lattice *l, uint32_t column, uint32_t row, vshi_cell *c) {
    const uint32_t s = (uint32_t)l->spacing;
    size_t i, found = 0;
    *c = (vshi_cell){
        .column = column, .row = row, .left = column, .right = column + s, .top = row, .bottom = row + s};
    if (vshi_lattice_lookup(l, column, row, &i) && vshi_lattice_lookup(l, column + s, row, &i) &&
        vshi_lattice_lookup(l, column, row + s, &i) && vshi_lattice_lookup(l, column + s, row + s, &i)) {
        return true;
    }
    uint32_t left = UINT32_MAX, right = 0, top = UINT32_MAX, bottom = 0;
    for (uint32_t y = row; y <= c->bottom; ++y) {
        for (uint32_t x = column; x <= c->right; ++x) {
            if (vshi_lattice_lookup(l, x, y, &i)) {
                left = x < left ? x : left;
                right = x > right ? x : right;
                top = y < top ? y : top;
                bottom = y;
                ++found;
            }
        }
    }
    c->left = left, c->right = right, c->top = top, c->bottom = bottom;
    return found > 0 && found == (size_t)(right - left + 1) * (bottom - top + 1);
}

/* Whether a texel is the corner of a cell, its own or one that ends at it. */
bool vshi_lattice_is_corner(const vshi_lattice *l, uint32_t column, uint32_t row) {
    const uint32_t s = (uint32_t)l->spacing, mask = s - 1;
    if (((column | row) & mask) == 0) {
        return true;
    }
    for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t before = k & 1, above = k >> 1;
        if ((before && ((column & mask) != 0 || column == 0)) || (above && ((row & mask) != 0 || row == 0))) {
            continue;
        }
        vshi_cell c;
        if (clip(l, (column & ~mask) - before * s, (row & ~mask) - above * s, &c) &&
            (column == c.left || column == c.right) && (row == c.top || row == c.bottom)) {
            return true;
        }
    }
    return false;
}

/* --- whether values between are good */

/* Corner values weighted for a place of the cell, 0 … 1 along both sides. */
static double mix(const double v[4], double x, double y) {
    return (v[0] * (1.0 - x) + v[1] * x) * (1.0 - y) + (v[2] * (1.0 - x) + v[3] * x) * y;
}

/* How far x lies between two lines, 0 … 1. */
double vshi_lattice_part(uint32_t x, uint32_t from, uint32_t to) {
    return to > from ? (double)(x - from) / (double)(to - from) : 0.0;
}

static vshi_vec position_of(const vshi_lattice *l, size_t i) {
    return vshi_to_field(l->field, l->points->positions + 3 * i);
}

static bool corners_agree(const vshi_lattice *l, const vshi_cell *c) {
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 4; ++k) {
        const double v = (double)l->values[c->corner[k]];
        if (isnan(v)) {
            return false;
        }
        low = fmin(low, v);
        high = fmax(high, v);
    }
    return high - low <= RANGE;
}

/* Whether all texels of a cell are there, in a plane, and turned alike. */
static bool lies_flat(const vshi_lattice *l, const vshi_cell *c, const vshi_vec p[4], double size) {
    const vshi_vec n = vshi_vec_off(l->points->normals + 3 * c->corner[0]);
    const double x[4] = {p[0].x, p[1].x, p[2].x, p[3].x}, y[4] = {p[0].y, p[1].y, p[2].y, p[3].y},
                 z[4] = {p[0].z, p[1].z, p[2].z, p[3].z};
    for (uint32_t row = c->top; row <= c->bottom; ++row) {
        for (uint32_t column = c->left; column <= c->right; ++column) {
            size_t i;
            if (!vshi_lattice_lookup(l, column, row, &i) ||
                vshi_dot(n, vshi_vec_off(l->points->normals + 3 * i)) < ALIKE) {
                return false;
            }
            const double u = vshi_lattice_part(column, c->left, c->right),
                         v = vshi_lattice_part(row, c->top, c->bottom);
            const vshi_vec off =
                vshi_sub(position_of(l, i), (vshi_vec){mix(x, u, v), mix(y, u, v), mix(z, u, v)});
            if (vshi_dot(off, off) > FLAT * FLAT * size * size) {
                return false;
            }
        }
    }
    return true;
}

static bool is_clear(const vshi_lattice *l, const vshi_cell *c, const vshi_vec p[4], double size) {
    const vshi_vec sum = vshi_add(vshi_add(p[0], p[1]), vshi_add(p[2], p[3]));
    const vshi_vec normal =
        vshi_direction_to_field(l->field, vshi_vec_off(l->points->normals + 3 * c->corner[0]));
    const double radius = fmin(CLEAR * size, l->distance);
    const vshi_vec centre = vshi_add(vshi_scale(sum, 0.25), vshi_scale(normal, radius));
    const float at[3] = {(float)centre.x, (float)centre.y, (float)centre.z};
    const double lack = fmax(LACK * radius, LACK_VOXELS);
    return (double)vshi_field_distance(l->field, at) >= radius - lack;
}

vshi_cell vshi_lattice_look_at(const vshi_lattice *l, uint32_t column, uint32_t row) {
    vshi_cell c;
    vshi_vec p[4];
    if (!clip(l, column, row, &c)) {
        return c;
    }
    for (int k = 0; k < 4; ++k) {
        if (!vshi_lattice_lookup(l, k & 1 ? c.right : c.left, k >> 1 ? c.bottom : c.top, &c.corner[k]) ||
            l->state[c.corner[k]] < LATTICE_KNOWN) {
            return c;
        }
        p[k] = position_of(l, c.corner[k]);
    }
    if (!corners_agree(l, &c)) {
        return c;
    }
    const double size = fmax(vshi_length(vshi_sub(p[3], p[0])), vshi_length(vshi_sub(p[2], p[1])));
    c.good = is_clear(l, &c, p, size) && lies_flat(l, &c, p, size);
    return c;
}

/* One of so many channels of the corners' values, at a place of the cell. */
float vshi_lattice_between(const float *values, size_t channels, size_t channel, const vshi_cell *c, double x,
                           double y) {
    double v[4];
    for (int k = 0; k < 4; ++k) {
        v[k] = (double)values[channels * c->corner[k] + channel];
    }
    return (float)mix(v, x, y);
}
