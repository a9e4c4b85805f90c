/* One tile of a lightmap: its cells and its samples. */
#include "lightmap/texels.h"

#include "base/memory.h"
#include "shade/shade.h"

#include <stdlib.h>
#include <string.h>

double vshi_tile_bytes(const vshi_charts *charts, int32_t threads) {
    const double all_cores = 64.0; /* for threads == 0 */
    const size_t tiles = vshi_charts_tiles(charts);
    size_t most = 0;
    for (size_t tile = 0; tile < tiles; ++tile) {
        const size_t count = charts->tile_start[tile + 1] - charts->tile_start[tile];
        most = count > most ? count : most;
    }
    const double at_work = (threads > 0 ? threads : all_cores) * (double)most;
    const double total = (double)charts->tile_start[tiles];
    return sizeof(vshi_uv_triangle) * (at_work < total ? at_work : total);
}

/* Meshes without an object number get numbers of their own, above all others. */
static uint64_t object_of(const vsh_mesh *mesh, size_t index) {
    return mesh->object > 0 ? mesh->object : (uint64_t)UINT32_MAX + 1 + index;
}

/* Lists the cells of a tile that a triangle reaches; returns how many. They are numbered from the one left of
 * and above the tile. */
static size_t list_cells(const vshi_charts *charts, const vshi_tile *tile, const vshi_uv_triangle *triangle,
                         size_t cells[VSHI_TILE_ACROSS * VSHI_TILE_ACROSS]) {
    size_t rows[2], columns[2], count = 0;
    if (!vshi_uv_cell_rows(&charts->raster, triangle, &rows[0], &rows[1])) {
        return 0;
    }
    const size_t left = tile->column * VSHI_TILE_CELLS, top = tile->row * VSHI_TILE_CELLS;
    for (size_t y = 0; y < VSHI_TILE_ACROSS; ++y) {
        if (top + y < rows[0] + 1 || top + y >= rows[1] + 1) {
            continue;
        }
        vshi_uv_cells(&charts->raster, triangle, top + y - 1, &columns[0], &columns[1]);
        for (size_t x = 0; x < VSHI_TILE_ACROSS; ++x) {
            if (left + x >= columns[0] + 1 && left + x < columns[1] + 1) {
                cells[count++] = y * VSHI_TILE_ACROSS + x;
            }
        }
    }
    return count;
}

vsh_result vshi_tile_open(const vshi_charts *charts, size_t number, vshi_tile *tile, vsh_error *error) {
    enum { CELLS = VSHI_TILE_ACROSS * VSHI_TILE_ACROSS };
    *tile = (vshi_tile){.column = number % charts->columns, .row = number / charts->columns};
    const size_t count = charts->tile_start[number + 1] - charts->tile_start[number];
    const size_t side = (size_t)VSHI_CELL * (size_t)charts->raster.supersample;
    const char *what = "tile of texels";
    const vshi_array arrays[] = {VSHI_ARRAY(tile->triangle, count),
                                 VSHI_ARRAY(tile->cell.owner, side * side)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    size_t cells[CELLS];
    for (size_t i = 0; i < count; ++i) {
        size_t local;
        vshi_uv_triangle *t = &tile->triangle[i];
        const size_t triangle = charts->tile_triangle[charts->tile_start[number] + i];
        const size_t mesh = vshi_charts_mesh(charts, triangle, &local);
        vshi_charts_triangle(charts, mesh, local, t);
        t->mesh = (uint32_t)mesh;
        t->local = (uint32_t)local;
        t->object = object_of(&charts->meshes[mesh], mesh);
        const size_t reached = list_cells(charts, tile, t, cells);
        for (size_t k = 0; k < reached; ++k) {
            ++tile->cell_start[cells[k] + 1];
        }
    }
    size_t total = 0;
    for (size_t cell = 0; cell <= CELLS; ++cell) {
        const size_t here = tile->cell_start[cell + 1];
        tile->cell_start[cell + 1] = total;
        total += here;
    }
    VSHI_TRY(vshi_allocate((void **)&tile->cell_triangle, total, sizeof *tile->cell_triangle, what, error));
    for (size_t i = 0; i < count; ++i) {
        const size_t reached = list_cells(charts, tile, &tile->triangle[i], cells);
        for (size_t k = 0; k < reached; ++k) {
            tile->cell_triangle[tile->cell_start[cells[k] + 1]++] = (uint32_t)i;
        }
    }
    return VSH_OK;
}

void vshi_tile_close(vshi_tile *tile) {
    free(tile->cell_triangle);
    free(tile->cell.owner);
    free(tile->triangle);
}

/* Counts texels that a mesh covers again, each once. */
static void count_overlap(const vshi_overlaps *overlaps, size_t mesh, const vshi_cell_overlap *taken) {
    if (taken->texels != 0) {
        atomic_fetch_add_explicit(&overlaps->texels[mesh], (size_t)__builtin_popcountll(taken->texels),
                                  memory_order_relaxed);
        atomic_fetch_add_explicit(&overlaps->others[mesh], (size_t)__builtin_popcountll(taken->others),
                                  memory_order_relaxed);
    }
}

/* Counts texels for the mesh of their first sample of another object. */
static void count_owners(const vshi_charts *charts, const vshi_tile *tile, uint64_t object, uint64_t texels,
                         const vshi_overlaps *overlaps) {
    const size_t n = (size_t)charts->raster.supersample, side = VSHI_CELL * n;
    for (uint64_t left = texels; left != 0; left &= left - 1) {
        const size_t bit = (size_t)__builtin_ctzll(left);
        const uint32_t *sample = tile->cell.owner + bit / VSHI_CELL * n * side + bit % VSHI_CELL * n;
        for (size_t k = 0; k < n * n; ++k) {
            const uint32_t owner = sample[k / n * side + k % n];
            if (owner != 0 && tile->triangle[owner - 1].object != object) {
                atomic_fetch_add_explicit(&overlaps->owners[tile->triangle[owner - 1].mesh], 1,
                                          memory_order_relaxed);
                break;
            }
        }
    }
}

static void cover(const vshi_charts *charts, vshi_tile *tile, const uint32_t *slot, size_t count,
                  const vshi_overlaps *overlaps) {
    size_t mesh = 0;
    vshi_cell_overlap again = {0, 0};
    for (size_t i = 0; i < count; ++i) {
        const vshi_uv_triangle *t = &tile->triangle[slot[i]];
        const vshi_cell_overlap taken =
            vshi_cell_cover(&charts->raster, tile->triangle, slot[i], &tile->cell);
        if (overlaps == NULL || taken.texels == 0) {
            continue;
        }
        if (t->mesh != mesh) {
            count_overlap(overlaps, mesh, &again);
            mesh = t->mesh;
            again = (vshi_cell_overlap){0, 0};
        }
        if (mesh == overlaps->watched) {
            count_owners(charts, tile, t->object, taken.others & ~again.others, overlaps);
        }
        again.texels |= taken.texels;
        again.others |= taken.others;
        atomic_store_explicit(&overlaps->triangles[charts->first[mesh] + t->local], 1, memory_order_relaxed);
    }
    if (overlaps != NULL) {
        count_overlap(overlaps, mesh, &again);
    }
}

bool vshi_tile_rasterize(const vshi_charts *charts, vshi_tile *tile, int32_t x, int32_t y,
                         const vshi_overlaps *overlaps) {
    const size_t cell = (size_t)(y + 1) * VSHI_TILE_ACROSS + (size_t)(x + 1);
    const size_t count = tile->cell_start[cell + 1] - tile->cell_start[cell];
    if (count == 0) { /* also outside the image */
        return false;
    }
    const uint32_t *slot = tile->cell_triangle + tile->cell_start[cell];
    vshi_cell_begin(&charts->raster, tile->column * VSHI_TILE_CELLS + (size_t)x,
                    tile->row * VSHI_TILE_CELLS + (size_t)y, &tile->cell);
    cover(charts, tile, slot, count, overlaps);
    for (size_t i = 0; i < count; ++i) {
        vshi_cell_touch(&charts->raster, tile->triangle, slot[i], &tile->cell);
    }
    return true;
}

uint32_t vshi_tile_owner(const vshi_charts *charts, const vshi_tile *tile, size_t bit) {
    const vshi_cell *cell = &tile->cell;
    const size_t n = (size_t)charts->raster.supersample, side = VSHI_CELL * n;
    uint32_t owner = 0;
    if ((cell->covered >> bit & 1) != 0) {
        const uint32_t *sample = cell->owner + bit / VSHI_CELL * n * side + bit % VSHI_CELL * n;
        for (size_t k = 0; k < n * n && owner == 0; ++k) {
            owner = sample[k / n * side + k % n];
        }
    } else if ((cell->border >> bit & 1) != 0) {
        owner = cell->nearest[bit];
    }
    return owner;
}

vsh_result vshi_samples_allocate(vshi_samples *samples, size_t room, bool tangents, vsh_error *error) {
    *samples = (vshi_samples){.room = room};
    const vshi_array arrays[] = {
        VSHI_ARRAY(samples->position, 3 * room),
        VSHI_ARRAY(samples->normal, 3 * room),
        VSHI_ARRAY(samples->geometric, 3 * room),
        VSHI_ARRAY(samples->lift, 3 * room),
        VSHI_ARRAY(samples->texel, room),
        VSHI_ARRAY(samples->mesh, room),
        VSHI_ARRAY(samples->tangent, tangents ? 4 * room : 0),
    };
    return VSHI_ALLOCATE_ALL(arrays, "texels", error);
}

void vshi_samples_free(vshi_samples *samples) {
    free(samples->tangent);
    free(samples->mesh);
    free(samples->texel);
    free(samples->lift);
    free(samples->geometric);
    free(samples->normal);
    free(samples->position);
    *samples = (vshi_samples){.count = 0};
}

static void write_sample(vshi_sample_writer *w, uint32_t number, uint32_t texel, const double weight[3],
                         bool border) {
    vshi_samples *samples = w->samples;
    const vshi_uv_triangle *triangle = &w->tile->triangle[number - 1];
    if (number != w->number) {
        const vsh_mesh *mesh = &w->charts->sorted.meshes[triangle->mesh];
        vshi_surface_set(mesh, triangle->local, &w->surface);
        if (samples->tangent != NULL) {
            double handedness;
            vshi_vec_to_floats(vshi_surface_tangent(mesh, triangle->local, &handedness), w->tangent);
            w->tangent[3] = (float)handedness;
        }
        w->number = number;
    }
    vshi_vec position, normal, lift;
    vshi_surface_at(&w->surface, weight, &position, &normal, &lift);
    const size_t i = samples->count++;
    vshi_vec_to_doubles(position, samples->position + 3 * i);
    vshi_vec_to_floats(normal, samples->normal + 3 * i);
    vshi_vec_to_floats(w->surface.geometric, samples->geometric + 3 * i);
    vshi_vec_to_floats(lift, samples->lift + 3 * i);
    samples->texel[i] = texel;
    const bool sheet = w->charts->sheet[w->charts->sorted.first[triangle->mesh] + triangle->local] != 0;
    samples->mesh[i] = triangle->mesh | (sheet ? VSHI_SAMPLE_SHEET : 0) | (border ? VSHI_SAMPLE_BORDER : 0);
    if (samples->tangent != NULL) {
        memcpy(samples->tangent + 4 * i, w->tangent, sizeof w->tangent);
    }
}

/* Writes the samples of texel (x, y) of the cell. */
static void write_texel(vshi_sample_writer *w, size_t x, size_t y) {
    const vshi_cell *cell = &w->tile->cell;
    const size_t n = (size_t)w->charts->sorted.raster.supersample, side = VSHI_CELL * n;
    const size_t column = cell->column * VSHI_CELL + x, row = cell->row * VSHI_CELL + y;
    const size_t bit = VSHI_CELL * y + x;
    const uint32_t texel = vsh_texel((uint32_t)column, (uint32_t)row);
    double weight[3];
    if (((cell->border >> bit) & 1) != 0) {
        const uint32_t number = cell->nearest[bit];
        vshi_uv_centroid_near(&w->tile->triangle[number - 1], (double)column + 0.5, (double)row + 0.5,
                              weight);
        write_sample(w, number, texel, weight, true);
        return;
    }
    for (size_t s = 0; ((cell->covered >> bit) & 1) != 0 && s < n * n; ++s) {
        const size_t sx = s % n, sy = s / n;
        const uint32_t number = cell->owner[(y * n + sy) * side + x * n + sx];
        if (number != 0) {
            vshi_uv_barycentric(&w->tile->triangle[number - 1],
                                (double)column + ((double)sx + 0.5) / (double)n,
                                (double)row + ((double)sy + 0.5) / (double)n, weight);
            write_sample(w, number, texel, weight, false);
        }
    }
}

/* Every second bit of a number of six bits. */
static size_t even_bits(size_t number) {
    return (number & 1) | (number >> 1 & 2) | (number >> 2 & 4);
}

/* Appends the samples of the last rasterised cell's texels in `mask`, along Morton's curve (1966), so that 4,
 * 16 or all 64 texels that follow each other are a square. */
static void write_cell(vshi_sample_writer *w, uint64_t mask) {
    for (size_t place = 0; place < (size_t)VSHI_CELL * VSHI_CELL; ++place) {
        const size_t x = even_bits(place), y = even_bits(place >> 1);
        if ((mask >> (VSHI_CELL * y + x) & 1) != 0) {
            write_texel(w, x, y);
        }
    }
}

void vshi_samples_write_rows(vshi_sample_writer *w, vshi_tile *tile, int32_t begin, int32_t end) {
    for (int32_t y = begin; y < end; ++y) {
        for (int32_t x = 0; x < VSHI_TILE_CELLS; ++x) {
            if (vshi_tile_rasterize(&w->charts->sorted, tile, x, y, NULL)) {
                write_cell(w, UINT64_MAX);
            }
        }
    }
}

void vshi_samples_write_frame(vshi_sample_writer *w, vshi_tile *tile) {
    static const uint64_t FIRST_COLUMN = UINT64_C(0x0101010101010101), FIRST_ROW = 0xff;
    enum { LAST = VSHI_TILE_CELLS, SHIFT = VSHI_CELL - 1 };
    for (int32_t y = -1; y <= LAST; ++y) {
        for (int32_t x = -1; x <= LAST; x += y < 0 || y == LAST ? 1 : LAST + 1) {
            const uint64_t columns = x < 0 ? FIRST_COLUMN << SHIFT : x == LAST ? FIRST_COLUMN : UINT64_MAX;
            const uint64_t rows = y < 0 ? FIRST_ROW << VSHI_CELL * SHIFT : y == LAST ? FIRST_ROW : UINT64_MAX;
            if (vshi_tile_rasterize(&w->charts->sorted, tile, x, y, NULL)) {
                write_cell(w, columns & rows);
            }
        }
    }
}

vsh_result vshi_tile_visit(const vsh_charts *charts, size_t number, bool tangents, vshi_samples_fn *visit,
                           void *user, vsh_error *error) {
    const size_t n = (size_t)charts->sorted.raster.supersample;
    vshi_tile tile;
    vshi_samples samples = {.count = 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_tile_open(&charts->sorted, number, &tile, error));
    VSHI_TRY_DONE(vshi_samples_allocate(&samples, (size_t)VSHI_TILE * VSHI_CELL * n * n, tangents, error));
    vshi_sample_writer writer = {.charts = charts, .tile = &tile, .samples = &samples};
    for (int32_t row = 0; row < VSHI_TILE_CELLS; ++row) {
        samples.count = 0;
        vshi_samples_write_rows(&writer, &tile, row, row + 1);
        visit(user, &samples);
    }
done:
    vshi_samples_free(&samples);
    vshi_tile_close(&tile);
    return result;
}
