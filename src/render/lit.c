/* Meshes with lightmaps on them, rasterised at a picture's samples. */
#include "base/memory.h"
#include "geometry/mesh.h"
#include "io/image/image.h"
#include "render/render.h"
#include "shade/shade.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct lightmap {
    const vsh_lit_meshes *of;
    const float *irradiance[3]; /* three, or all NULL */
    const float **shadow;       /* [light_count], without irradiance */
    const float *ao;            /* or NULL */
} lightmap;

typedef struct triangle {
    vshi_vec corner[3]; /* from the eye */
    uint32_t map, mesh, number;
    int32_t first[2], last[2]; /* columns and rows that it may cover; first > last: none */
} triangle;

struct vshi_lit {
    const vsh_render_options *options;
    const vsh_light *lights;
    size_t light_count;
    vshi_sample_grid grid;
    lightmap *maps;
    const float **planes; /* shadows of all maps */
    triangle *triangles;
    size_t triangle_count;
};

static size_t count_triangles(const vsh_render_options *options) {
    size_t count = 0;
    for (size_t i = 0; i < options->lit_count; ++i) {
        for (size_t m = 0; m < options->lit[i].mesh_count; ++m) {
            count += options->lit[i].meshes[m].triangle_count;
        }
    }
    return count;
}

double vshi_lit_bytes(const vsh_render_options *options) {
    return (double)count_triangles(options) * sizeof(triangle);
}

void vshi_lit_free(vshi_lit *lit) {
    if (lit != NULL) {
        free(lit->maps); /* the block's first array */
        free(lit);
    }
}

/* --- checks */

static vsh_result find_planes(const vshi_lit *lit, size_t index, lightmap *map, vsh_error *error) {
    static const char *const irradiance[] = {"irradiance.R", "irradiance.G", "irradiance.B"};
    const vsh_image *image = map->of->lightmap;
    size_t found = 0;
    for (int c = 0; c < 3; ++c) {
        map->irradiance[c] = vshi_image_find_plane(image, irradiance[c]);
        found += map->irradiance[c] != NULL;
    }
    map->ao = vshi_image_find_plane(image, "ao");
    if (found == 3) {
        return VSH_OK;
    }
    memset(map->irradiance, 0, sizeof map->irradiance);
    for (size_t l = 0; l < lit->light_count; ++l) {
        char name[VSH_CHANNEL_NAME];
        snprintf(name, sizeof name, "shadow.%s", lit->lights[l].name);
        map->shadow[l] = vshi_image_find_plane(image, name);
        if (map->shadow[l] == NULL) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "lightmap %zu: no channel %s, nor irradiance.R, .G and .B", index, name);
        }
    }
    return lit->light_count > 0 || map->ao != NULL
               ? VSH_OK
               : vshi_fail(
                     error, VSH_ERROR_INPUT,
                     "lightmap %zu: no channel ao, nor irradiance.R, .G and .B, and the scene has no lights",
                     index);
}

static vsh_result check_meshes(const vsh_lit_meshes *of, size_t index, vsh_error *error) {
    const vsh_image *image = of->lightmap;
    if ((image != NULL && (image->width < 1 || image->height < 1)) ||
        (of->meshes == NULL && of->mesh_count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lit meshes %zu: no lightmap, or no meshes", index);
    }
    for (size_t m = 0; m < of->mesh_count; ++m) {
        const vsh_mesh *mesh = &of->meshes[m];
        VSHI_TRY(vshi_mesh_check_data(mesh, m, error));
        if (image != NULL && mesh->uvs == NULL) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: no UVs", vshi_mesh_label(mesh, m).text);
        }
    }
    return VSH_OK;
}

vsh_result vshi_lit_check(const vsh_render_options *options, vsh_error *error) {
    if (options->lit == NULL && options->lit_count > 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lit is NULL with a lit_count of %zu",
                         options->lit_count);
    }
    for (size_t i = 0; i < options->lit_count; ++i) {
        VSHI_TRY(check_meshes(&options->lit[i], i, error));
    }
    return VSH_OK;
}

/* --- triangles on the samples */

static int32_t within(double x, int32_t count) {
    return x > 0.0 ? (x < (double)count ? (int32_t)x : count - 1) : 0;
}

/* Columns and rows of the samples that a triangle's projection may cover, a cell's jitter included. */
static void find_bounds(const vshi_sample_grid *grid, triangle *t) {
    const vshi_view_frame *frame = &grid->frame;
    const double pixel2 = vshi_dot(frame->right, frame->right);
    const int32_t count[2] = {grid->columns, grid->rows};
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    int behind = 0;
    for (int k = 0; k < 3; ++k) {
        const double depth = vshi_dot(t->corner[k], frame->forward);
        behind += !(depth > 0.0);
        const double x[2] = {vshi_dot(t->corner[k], frame->right), vshi_dot(t->corner[k], frame->down)};
        for (int axis = 0; axis < 2; ++axis) {
            const double at = (x[axis] / (pixel2 * depth) + frame->middle[axis] + 1.0) * grid->samples;
            low[axis] = fmin(low[axis], at);
            high[axis] = fmax(high[axis], at);
        }
    }
    for (int axis = 0; axis < 2; ++axis) {
        const bool whole = behind > 0; /* its projection has no end */
        const bool out =
            behind == 3 || (!whole && (high[axis] < -1.0 || low[axis] > (double)count[axis] + 1.0));
        t->first[axis] = whole ? 0 : within(low[axis] - 1.0, count[axis]);
        t->last[axis] = out ? -1 : whole ? count[axis] - 1 : within(high[axis] + 1.0, count[axis]);
    }
}

static void place_triangles(vshi_lit *lit) {
    size_t at = 0;
    for (size_t i = 0; i < lit->options->lit_count; ++i) {
        const vsh_lit_meshes *of = &lit->options->lit[i];
        for (size_t m = 0; m < of->mesh_count; ++m) {
            for (size_t k = 0; k < of->meshes[m].triangle_count; ++k) {
                triangle *t = &lit->triangles[at++];
                vshi_vec corner[3];
                vshi_mesh_triangle(&of->meshes[m], k, corner);
                for (int c = 0; c < 3; ++c) {
                    t->corner[c] = vshi_sub(corner[c], lit->grid.frame.eye);
                }
                t->map = (uint32_t)i;
                t->mesh = (uint32_t)m;
                t->number = (uint32_t)k;
                find_bounds(&lit->grid, t);
            }
        }
    }
}

vsh_result vshi_lit_create(const vsh_render_options *options, const vsh_light *lights, size_t light_count,
                           const vshi_sample_grid *grid, vshi_lit **lit, vsh_error *error) {
    *lit = NULL;
    if (options->lit_count == 0) {
        return VSH_OK;
    }
    const size_t count = count_triangles(options), shadows = options->lit_count * light_count;
    vshi_lit *made;
    vsh_result result;
    if (count >= UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "lit meshes: more than 2^32 - 2 triangles");
    }
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "lit meshes", error));
    *made = (vshi_lit){.options = options,
                       .lights = lights,
                       .light_count = light_count,
                       .grid = *grid,
                       .triangle_count = count};
    const vshi_array arrays[] = {VSHI_ARRAY(made->maps, options->lit_count),
                                 VSHI_ARRAY(made->planes, shadows), VSHI_ARRAY(made->triangles, count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, "lit meshes", error));
    for (size_t i = 0; i < options->lit_count; ++i) {
        made->maps[i].of = &options->lit[i];
        made->maps[i].shadow = made->planes + i * light_count;
        if (options->lit[i].lightmap != NULL) {
            VSHI_TRY_DONE(find_planes(made, i, &made->maps[i], error));
        }
    }
    place_triangles(made);
    *lit = made;
    made = NULL;
done:
    vshi_lit_free(made);
    return result;
}

/* Volumes of the ray with each edge: all of one sign where it passes within. An edge has the same one, but
 * for its sign, from both its triangles, so nothing gets through between them. */
static bool cross_triangle(const triangle *t, vshi_vec ray, double weight[3]) {
    int above = 0, below = 0;
    for (int k = 0; k < 3; ++k) {
        weight[k] = vshi_dot(ray, vshi_cross(t->corner[(k + 1) % 3], t->corner[(k + 2) % 3]));
        above += weight[k] >= 0.0;
        below += weight[k] <= 0.0;
    }
    return (above == 3 || below == 3) && above + below < 6;
}

void vshi_lit_raster(const vshi_lit *lit, const vshi_lit_band *band, size_t strip) {
    const vshi_sample_grid *grid = &lit->grid;
    const int32_t begin = (int32_t)strip * VSHI_LIT_STRIP;
    const int32_t end = begin + VSHI_LIT_STRIP < grid->columns ? begin + VSHI_LIT_STRIP : grid->columns;
    const int32_t last_row = band->first_row + band->rows - 1;
    for (int32_t row = 0; row < band->rows; ++row) {
        for (int32_t column = begin; column < end; ++column) {
            band->depth[(size_t)row * (size_t)grid->columns + (size_t)column] = INFINITY;
        }
    }
    for (size_t i = 0; i < lit->triangle_count; ++i) {
        const triangle *t = &lit->triangles[i];
        const int32_t left = t->first[0] > begin ? t->first[0] : begin;
        const int32_t right = t->last[0] < end - 1 ? t->last[0] : end - 1;
        const int32_t top = t->first[1] > band->first_row ? t->first[1] : band->first_row;
        const int32_t bottom = t->last[1] < last_row ? t->last[1] : last_row;
        if (left > right || top > bottom) {
            continue;
        }
        const vshi_vec normal =
            vshi_cross(vshi_sub(t->corner[1], t->corner[0]), vshi_sub(t->corner[2], t->corner[0]));
        const double height = vshi_dot(t->corner[0], normal);
        for (int32_t row = top; row <= bottom; ++row) {
            for (int32_t column = left; column <= right; ++column) {
                const vshi_vec ray = vshi_sample_ray(grid, column, row);
                const size_t at = (size_t)(row - band->first_row) * (size_t)grid->columns + (size_t)column;
                double weight[3];
                const double depth = height / vshi_dot(ray, normal);
                if (depth > 0.0 && depth < band->depth[at] && cross_triangle(t, ray, weight)) {
                    band->depth[at] = depth;
                    band->triangle[at] = (uint32_t)i;
                }
            }
        }
    }
}

/* --- light */

static int32_t clamp(int64_t x, int32_t count) {
    return x < 0 ? 0 : x < count ? (int32_t)x : count - 1;
}

typedef struct footprint {
    size_t texel[4];
    double weight[4];
} footprint;

/* The four texels around a place of the UV square, texel centres at (i + ½) / size, v up. */
static footprint look_up(const vsh_image *image, const double uv[2]) {
    const double x = uv[0] * image->width - 0.5, y = (1.0 - uv[1]) * image->height - 0.5;
    const bool finite = fabs(x) < 1e9 && fabs(y) < 1e9;
    const int64_t column = finite ? (int64_t)floor(x) : 0, row = finite ? (int64_t)floor(y) : 0;
    const double fx = finite ? x - (double)column : 0.0, fy = finite ? y - (double)row : 0.0;
    footprint f;
    for (int k = 0; k < 4; ++k) {
        const int right = k & 1, down = k >> 1;
        f.texel[k] = (size_t)clamp(row + down, image->height) * (size_t)image->width +
                     (size_t)clamp(column + right, image->width);
        f.weight[k] = (right ? fx : 1.0 - fx) * (down ? fy : 1.0 - fy);
    }
    return f;
}

/* NaN counts as dark. */
static float blend(const footprint *f, const float *plane) {
    double sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        const double value = plane[f->texel[k]];
        sum += isfinite(value) ? f->weight[k] * value : 0.0;
    }
    return (float)sum;
}

/* Where a ray meets a triangle. */
typedef struct spot {
    vshi_vec at, lift, flat, normal; /* flat and normal on one side, whichever */
    double facing;                   /* -1: that side is seen from behind */
    double uv[2];
} spot;

static spot find_spot(const triangle *t, const vsh_mesh *mesh, vshi_vec ray) {
    spot s = {.uv = {0.0, 0.0}};
    double weight[3];
    vshi_vec corner[3];
    uint32_t vertex[3];
    cross_triangle(t, ray, weight);
    const double sum = weight[0] + weight[1] + weight[2];
    vshi_mesh_triangle_of(mesh, t->number, corner, vertex);
    for (int k = 0; k < 3; ++k) {
        weight[k] /= sum;
        for (int axis = 0; axis < 2 && mesh->uvs != NULL; ++axis) {
            s.uv[axis] += weight[k] * (double)mesh->uvs[2 * (size_t)vertex[k] + (size_t)axis];
        }
    }
    vshi_surface surface;
    vshi_surface_set(mesh, t->number, &surface);
    const int second = surface.mirrored ? 2 : 1; /* of the mesh's indices */
    vshi_surface_at(&surface, (double[]){weight[0], weight[second], weight[3 - second]}, &s.at, &s.normal,
                    &s.lift);
    s.at = vshi_sub(s.at, s.lift);
    s.flat = surface.geometric;
    s.facing = vshi_dot(s.flat, ray) > 0.0 ? -1.0 : 1.0;
    return s;
}

bool vshi_lit_is_bare(const vshi_lit *lit, uint32_t number) {
    return lit->maps[lit->triangles[number].map].of->lightmap == NULL;
}

vshi_lit_point vshi_lit_meet(const vshi_lit *lit, uint32_t number, vshi_vec ray) {
    const triangle *t = &lit->triangles[number];
    const vsh_lit_meshes *of = lit->maps[t->map].of;
    const spot s = find_spot(t, &of->meshes[t->mesh], ray);
    return (vshi_lit_point){{s.at, s.facing > 0.0 ? s.lift : (vshi_vec){0.0, 0.0, 0.0},
                             vshi_scale(s.flat, s.facing), vshi_scale(s.normal, s.facing)},
                            of->color};
}

void vshi_lit_grow_box(const vshi_lit *lit, vshi_vec *low, vshi_vec *high) {
    for (size_t i = 0; lit != NULL && i < lit->triangle_count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const vshi_vec at = vshi_add(lit->triangles[i].corner[k], lit->grid.frame.eye);
            *low = (vshi_vec){fmin(low->x, at.x), fmin(low->y, at.y), fmin(low->z, at.z)};
            *high = (vshi_vec){fmax(high->x, at.x), fmax(high->y, at.y), fmax(high->z, at.z)};
        }
    }
}

void vshi_lit_shade(const vshi_lit *lit, uint32_t number, vshi_vec ray, float color[3], float normal[3]) {
    const triangle *t = &lit->triangles[number];
    const lightmap *map = &lit->maps[t->map];
    const spot s = find_spot(t, &map->of->meshes[t->mesh], ray);
    const double position[3] = {s.at.x, s.at.y, s.at.z};
    const float front[3] = {(float)s.normal.x, (float)s.normal.y, (float)s.normal.z};
    const footprint f = look_up(map->of->lightmap, s.uv);
    float light[3] = {0.0f, 0.0f, 0.0f};
    if (map->irradiance[0] != NULL) {
        for (int c = 0; c < 3; ++c) {
            light[c] = blend(&f, map->irradiance[c]);
        }
    } else {
        const vsh_points points = {1, position, front, NULL};
        for (size_t l = 0; l < lit->light_count; ++l) {
            const float visible = blend(&f, map->shadow[l]);
            vshi_shade_irradiance(&points, NULL, &lit->lights[l], &visible, &lit->options->tint, light);
        }
    }
    const bool done = map->irradiance[0] != NULL && map->of->ambient;
    const double open = done ? 0.0 : map->ao != NULL ? (double)blend(&f, map->ao) : 1.0;
    for (int c = 0; c < 3; ++c) {
        color[c] = (float)(map->of->color[c] * ((double)light[c] + lit->options->sky[c] * open));
        normal[c] = (float)s.facing * front[c];
    }
}
