/* The alpha of textures and vertices, by which a model's meshes cast. */
#include "scene/assets.h"

#include "base/job.h"
#include "base/memory.h"
#include "geometry/alpha_mask.h"
#include "geometry/mesh.h"
#include "io/image/image.h"
#include "io/model/model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double HALF = 0.5; /* blended materials are opaque from this alpha on */

enum { LARGEST = (1 << 16) - 1 }; /* texels along a side */

/* A material's mask. */
typedef struct material {
    enum {
        NOT_READ,
        WHOLE,   /* no mask, or an opaque one */
        NOTHING, /* all of it is clear */
        BY_MASK
    } state;
    bool binary; /* its texture is binary, and its factor keeps it so */
    vsh_alpha_mask mask;
    vshi_mask_table table; /* NULL sums: not made yet */
} material;

/* The alpha of a shape's vertex colours, which is linear over a triangle. */
typedef struct vertex_alpha {
    bool uniform;  /* all vertices have the alpha `factor` */
    double factor; /* 0 … 1; 1 for alphas that are not finite */
    bool binary;   /* nearly all vertices are clear or opaque, and there are some of both */
    float *uvs;    /* [count][2], for mask_by_vertices(); NULL if uniform */
} vertex_alpha;

/* A shape's triangles, sorted by its mask. */
typedef struct shape {
    bool sorted;
    uint32_t *opaque, *mixed; /* indices of whole and of cut triangles; NULL: all triangles, or none */
    size_t opaque_count, mixed_count;
    bool has_vertices; /* `vertices` is filled */
    vertex_alpha vertices;
    bool masked; /* by `mask`, which takes the vertices' alpha into account; else by its material's */
    vsh_alpha_mask mask;
} shape;

typedef struct texture {
    const void *of;  /* vshi_material.image or .image_path */
    int32_t channel; /* VSHI_MASK_CHANNEL_… */
    uint8_t *alpha;  /* NULL: it has none, or could not be read */
    int32_t width, height;
    bool binary; /* nearly all of it is clear or opaque, and there is some of both */
} texture;

struct vshi_masks {
    const vsh_model *model;
    const char *path;
    material *materials; /* [material count of the model] */
    texture *textures;   /* [texture_count], of as many */
    size_t texture_count;
    shape *shapes; /* [shape count of the model] */
};

vsh_result vshi_masks_create(const vsh_model *model, const char *path, vshi_masks **masks, vsh_error *error) {
    const size_t materials = model->material_count;
    VSHI_TRY(vshi_allocate((void **)masks, 1, sizeof **masks, "alpha masks", error));
    vshi_masks *made = *masks;
    made->model = model;
    made->path = path;
    const vshi_array arrays[] = {VSHI_ARRAY(made->materials, materials),
                                 VSHI_ARRAY(made->textures, materials),
                                 VSHI_ARRAY(made->shapes, model->shape_count)};
    return VSHI_ALLOCATE_ALL(arrays, "alpha masks", error);
}

void vshi_masks_trim(vshi_masks *masks) {
    for (size_t i = 0; masks->materials != NULL && i < masks->model->material_count; ++i) {
        vshi_mask_table_free(&masks->materials[i].table);
    }
}

void vshi_masks_free(vshi_masks *masks) {
    if (masks == NULL) {
        return;
    }
    vshi_masks_trim(masks);
    for (size_t i = 0; masks->shapes != NULL && i < masks->model->shape_count; ++i) {
        free(masks->shapes[i].opaque);
        free(masks->shapes[i].mixed);
        free(masks->shapes[i].vertices.uvs);
    }
    for (size_t i = 0; i < masks->texture_count; ++i) {
        free(masks->textures[i].alpha);
    }
    free(masks->materials);
    free(masks->textures);
    free(masks->shapes);
    free(masks);
}

/* --- alpha of vertices */

/* Whether alphas of 8 bits look like a cut-out's, whose edges are few texels wide. Smoke and glass have
 * values in between everywhere. */
static bool is_binary(const uint8_t *alpha, size_t count) {
    static const double BETWEEN = 0.25, SOME = 0.01;
    enum { CLEAR = 25, OPAQUE = 230 };
    size_t clear = 0, opaque = 0;
    for (size_t i = 0; i < count; ++i) {
        clear += alpha[i] <= CLEAR;
        opaque += alpha[i] >= OPAQUE;
    }
    const double all = (double)count;
    return (double)(count - clear - opaque) <= BETWEEN * all && (double)clear >= SOME * all &&
           (double)opaque >= SOME * all;
}

static float clamp_alpha(float alpha) {
    return !isfinite(alpha) || alpha > 1.0F ? 1.0F : alpha < 0.0F ? 0.0F : alpha;
}

static vsh_result find_vertex_alpha(const vshi_model_shape *of, const char *what, const vsh_run *run,
                                    vertex_alpha *alpha, vsh_error *error) {
    const size_t count = of->vertex_count;
    uint8_t *bytes = NULL;
    alpha->factor = count > 0 ? (double)clamp_alpha(of->alphas[0]) : 1.0;
    for (size_t v = 1; v < count && alpha->uniform; ++v) {
        alpha->uniform = (double)clamp_alpha(of->alphas[v]) == alpha->factor;
    }
    if (alpha->uniform) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_check_limit(run, (1.0 + sizeof(float[2])) * (double)count, what, error));
    VSHI_TRY(vshi_allocate((void **)&alpha->uvs, count, sizeof(float[2]), what, error));
    VSHI_TRY(vshi_allocate((void **)&bytes, count, 1, what, error));
    for (size_t v = 0; v < count; ++v) {
        alpha->uvs[2 * v] = clamp_alpha(of->alphas[v]);
        bytes[v] = (uint8_t)(255.0F * alpha->uvs[2 * v] + 0.5F);
    }
    alpha->binary = is_binary(bytes, count);
    free(bytes);
    return VSH_OK;
}

/* Makes a mask that is opaque if base_alpha × a vertex's alpha is at least alpha_cutoff. Its texture has two
 * texels, 0 and 1: a lookup at the vertex's alpha gives that alpha. */
static vsh_alpha_mask mask_by_vertices(double base_alpha, double alpha_cutoff) {
    static const uint8_t ramp[2] = {0, 255};
    return (vsh_alpha_mask){.alpha = ramp,
                            .width = 2,
                            .height = 1,
                            .wrap = {VSH_WRAP_CLAMP, VSH_WRAP_CLAMP},
                            /* from the middle of the first texel to that of the second */
                            .uv_transform = {0.5, 0.0, 0.25, 0.0, 0.0, 0.5},
                            .alpha_cutoff = alpha_cutoff,
                            .base_alpha = base_alpha};
}

/* --- textures */

/* Alpha as a weighted sum of planes; NULL: no such plane. */
typedef struct alpha_source {
    const float *planes[3];
    float weights[3];
} alpha_source;

static float find_alpha(const alpha_source *source, size_t texel) {
    float sum = 0.0f;
    for (int i = 0; i < 3; ++i) {
        sum += source->planes[i] != NULL ? source->weights[i] * source->planes[i][texel] : 0.0f;
    }
    return 255.0f * sum + 0.5f;
}

/* Whether a texel is not opaque, in 8 bits. */
static bool varies(const alpha_source *source, size_t texels) {
    bool found = false;
    for (size_t i = 0; source->planes[0] != NULL && i < texels && !found; ++i) {
        found = !(find_alpha(source, i) >= 255.0f);
    }
    return found;
}

static alpha_source find_source(const vsh_image *image, int32_t channel, size_t texels) {
    static const char *const names[] = {"A", "R", "G", "B"};
    const float *grey = vshi_image_find_plane(image, "Y");
    const alpha_source luminance = {{vshi_image_find_plane(image, "R"), vshi_image_find_plane(image, "G"),
                                     vshi_image_find_plane(image, "B")},
                                    {0.2126f, 0.7152f, 0.0722f}};
    alpha_source one = {{NULL}, {1.0f, 0.0f, 0.0f}};
    if (channel <= VSHI_MASK_CHANNEL_BLUE || channel == VSHI_MASK_CHANNEL_AUTO) {
        one.planes[0] = vshi_image_find_plane(image, names[channel <= VSHI_MASK_CHANNEL_BLUE ? channel : 0]);
    }
    if (channel == VSHI_MASK_CHANNEL_ALPHA || (channel == VSHI_MASK_CHANNEL_AUTO && varies(&one, texels))) {
        return one;
    }
    one.planes[0] = one.planes[0] != NULL && channel != VSHI_MASK_CHANNEL_AUTO ? one.planes[0] : grey;
    return one.planes[0] != NULL ? one : luminance;
}

/* Keeps the alpha of an image, 8 bits a texel, unless it is opaque everywhere. */
static vsh_result keep_alpha(const vsh_image *image, const char *path, const vsh_run *run, texture *to,
                             vsh_error *error) {
    const size_t texels = (size_t)image->width * (size_t)image->height;
    const alpha_source from = find_source(image, to->channel, texels);
    if (!varies(&from, texels)) {
        return VSH_OK;
    }
    if (image->width > LARGEST || image->height > LARGEST) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: %d × %d texels, at most %d along a side", path,
                         image->width, image->height, LARGEST);
    }
    VSHI_TRY(
        vshi_check_limit(run, (double)texels * (1.0 + sizeof(float) * image->channel_count), path, error));
    VSHI_TRY(vshi_allocate((void **)&to->alpha, texels, 1, path, error));
    for (size_t i = 0; i < texels; ++i) {
        const float value = find_alpha(&from, i);
        to->alpha[i] = (uint8_t)(value >= 255.0f ? 255.0f : value > 0.0f ? value : 0.0f);
    }
    to->width = image->width;
    to->height = image->height;
    to->binary = is_binary(to->alpha, texels);
    return VSH_OK;
}

static bool is_fatal(vsh_result result) {
    return result == VSH_ERROR_MEMORY || result == VSH_ERROR_CANCELLED || result == VSH_ERROR_LIMIT ||
           result == VSH_ERROR_ARGUMENT;
}

/* Reads the texture of a material, once for all materials that have it. An unreadable texture is opaque. */
static vsh_result read_texture(vshi_masks *masks, const vshi_material *given, const vsh_run *run,
                               const texture **found, vsh_error *error) {
    const void *of = given->image != NULL ? given->image : given->image_path;
    for (size_t i = 0; i < masks->texture_count; ++i) {
        if (masks->textures[i].of == of && masks->textures[i].channel == given->image_channel) {
            *found = &masks->textures[i];
            return VSH_OK;
        }
    }
    texture *made = &masks->textures[masks->texture_count++];
    *found = made;
    made->of = of;
    made->channel = given->image_channel;
    char name[600];
    snprintf(name, sizeof name, "%.400s: the texture of material '%.100s'", masks->path,
             given->name != NULL ? given->name : "");
    vsh_image_file *file = NULL;
    vsh_error why;
    vsh_result result = given->image != NULL
                            ? vshi_image_read_bytes(name, given->image, given->image_size, run, &file, &why)
                            : vsh_image_read(given->image_path, run, &file, &why);
    if (result == VSH_OK) {
        const vsh_image image = vsh_image_view(file);
        result = keep_alpha(&image, name, run, made, &why);
    }
    vsh_image_free(file);
    if (result == VSH_OK) {
        return VSH_OK;
    }
    if (is_fatal(result)) {
        return vshi_fail(error, result, "%s", why.message);
    }
    vshi_warn(run, "%s; material '%s' casts whole, without the holes of its texture", why.message,
              given->name != NULL ? given->name : "");
    return VSH_OK;
}

/* --- materials */

static vsh_result read_material(vshi_masks *masks, const vshi_material *given, material *m,
                                const vsh_run *run, vsh_error *error) {
    const bool masked = given->alpha == VSH_ALPHA_MASKED;
    if (m->state != NOT_READ) {
        return VSH_OK;
    }
    m->state = WHOLE;
    if (given->alpha == VSH_ALPHA_OPAQUE || (masked && !(given->alpha_cutoff > 0.0))) {
        return VSH_OK;
    }
    const texture *found = NULL;
    if (given->image != NULL || given->image_path != NULL) {
        VSHI_TRY(read_texture(masks, given, run, &found, error));
    }
    if (masked && given->base_alpha < given->alpha_cutoff) {
        m->state = NOTHING;
    } else if (found != NULL && found->alpha != NULL) {
        m->state = BY_MASK;
        m->binary = found->binary && given->base_alpha >= HALF;
        m->mask = (vsh_alpha_mask){.alpha = found->alpha,
                                   .width = found->width,
                                   .height = found->height,
                                   .wrap = {given->wrap[0], given->wrap[1]},
                                   .alpha_cutoff = masked ? given->alpha_cutoff : HALF,
                                   .base_alpha = masked ? given->base_alpha : 1.0};
        memcpy(m->mask.uv_transform, given->uv_transform, sizeof given->uv_transform);
    }
    return VSH_OK;
}

/* --- shapes */

/* A mesh with its material and shape. */
typedef struct masked_mesh {
    vshi_material given;
    material *material; /* NULL: it has none, and so is opaque */
    shape *shape;
} masked_mesh;

/* Makes the shape's mask from the alpha of its vertices, if it has any and its material is not opaque. */
static vsh_result read_vertices(vshi_masks *masks, const masked_mesh *mm, size_t mesh, const vsh_run *run,
                                vsh_error *error) {
    const vshi_material *given = &mm->given;
    const vshi_model_shape *of = &masks->model->shapes[masks->model->entries[mesh].shape];
    const material *m = mm->material;
    shape *s = mm->shape;
    if (s->has_vertices) {
        return VSH_OK;
    }
    s->has_vertices = true;
    s->vertices = (vertex_alpha){.uniform = true, .factor = 1.0};
    if (of->alphas == NULL || given->alpha == VSH_ALPHA_OPAQUE) {
        return VSH_OK;
    }
    const bool masked = given->alpha == VSH_ALPHA_MASKED;
    VSHI_TRY(find_vertex_alpha(of, masks->path, run, &s->vertices, error));
    if (m->state == WHOLE && !s->vertices.uniform && (!masked || given->alpha_cutoff > 0.0)) {
        s->masked = true;
        s->mask =
            masked ? mask_by_vertices(given->base_alpha, given->alpha_cutoff) : mask_by_vertices(1.0, HALF);
    } else if (m->state == BY_MASK && s->vertices.uniform && masked) {
        s->masked = true;
        s->mask = m->mask;
        s->mask.base_alpha *= s->vertices.factor;
    } else if (m->state == BY_MASK && !s->vertices.uniform) {
        const vsh_mesh view = vsh_model_mesh(masks->model, mesh, -1);
        vshi_warn(run,
                  "%s: %s: the alpha of its vertices is ignored beside a texture's; put it into the texture",
                  masks->path, vshi_mesh_label(&view, mesh).text);
    }
    return VSH_OK;
}

/* Finds the material and the shape of a mesh, and reads them once. */
static vsh_result read_mesh(vshi_masks *masks, size_t mesh, const vsh_run *run, masked_mesh *mm,
                            vsh_error *error) {
    const size_t own = masks->model->entries[mesh].shape;
    const int32_t number = masks->model->shapes[own].material - 1;
    *mm = (masked_mesh){.shape = &masks->shapes[own]};
    if (number < 0) {
        return VSH_OK;
    }
    mm->given = vshi_model_get_material(masks->model, (size_t)number);
    mm->material = &masks->materials[number];
    VSHI_TRY(read_material(masks, &mm->given, mm->material, run, error));
    return read_vertices(masks, mm, mesh, run, error);
}

vsh_result vshi_masks_blend(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_blend *blend,
                            vsh_error *error) {
    masked_mesh mm;
    *blend = VSHI_BLEND_GLASS;
    VSHI_TRY(read_mesh(masks, mesh, run, &mm, error));
    if (mm.material == NULL || mm.given.alpha != VSH_ALPHA_BLENDED) {
        return VSH_OK;
    }
    const vertex_alpha *v = &mm.shape->vertices;
    const double factor = mm.given.base_alpha * (v->uniform ? v->factor : 1.0);
    const bool binary = mm.material->state == BY_MASK ? mm.material->binary : v->binary;
    if (binary && factor >= HALF) {
        *blend = VSHI_BLEND_CUT_OUT;
    } else if (mm.material->state == WHOLE && mm.given.by_texture != 0 && mm.given.base_alpha >= 1.0) {
        *blend = VSHI_BLEND_NOTHING;
    }
    return VSH_OK;
}

static vsh_result allocate_list(size_t count, size_t all, const vsh_run *run, uint32_t **list,
                                vsh_error *error) {
    if (count == 0 || count == all) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_check_limit(run, 12.0 * (double)count, "triangles of masked materials", error));
    return vshi_allocate((void **)list, 3 * count, sizeof **list, "triangles of masked materials", error);
}

/* Sorts the triangles of a mesh with the mask's UVs. */
static vsh_result sort_triangles(const vshi_mask_table *table, const vsh_mesh *mesh, const vsh_run *run,
                                 shape *s, vsh_error *error) {
    unsigned char *covers = NULL;
    const size_t all = mesh->triangle_count;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&covers, all, 1, "triangles of masked materials", error));
    for (size_t i = 0; i < all; ++i) {
        vshi_mask_place places[3];
        for (size_t k = 0; k < 3; ++k) {
            places[k] = vshi_alpha_mask_place(table->mask, mesh->uvs + 2 * (size_t)mesh->indices[3 * i + k]);
        }
        covers[i] = (unsigned char)vshi_mask_table_cover(table, places);
        s->opaque_count += covers[i] == VSHI_MASK_OPAQUE;
        s->mixed_count += covers[i] == VSHI_MASK_MIXED;
    }
    VSHI_TRY_DONE(allocate_list(s->opaque_count, all, run, &s->opaque, error));
    VSHI_TRY_DONE(allocate_list(s->mixed_count, all, run, &s->mixed, error));
    uint32_t *opaque = s->opaque, *mixed = s->mixed;
    for (size_t i = 0; i < all; ++i) {
        uint32_t **list = covers[i] == VSHI_MASK_OPAQUE ? &opaque : &mixed;
        if (covers[i] != VSHI_MASK_CLEAR && *list != NULL) {
            memcpy(*list, mesh->indices + 3 * i, 3 * sizeof **list);
            *list += 3;
        }
    }
    s->sorted = true;
done:
    free(covers);
    return result;
}

/* Sorts by the shape's mask, or by its material's, whose table is kept for other shapes. */
static vsh_result sort_shape(material *m, const vsh_mesh *textured, const vsh_run *run, shape *s,
                             vsh_error *error) {
    vshi_mask_table own = {.sums = NULL};
    vshi_mask_table *table = s->masked ? &own : &m->table;
    if (table->sums == NULL) {
        VSHI_TRY(vshi_mask_table_create(s->masked ? &s->mask : &m->mask, run, table, error));
    }
    const vsh_result result = sort_triangles(table, textured, run, s, error);
    vshi_mask_table_free(&own);
    return result;
}

vsh_result vshi_masks_cast(vshi_masks *masks, size_t index, const vsh_run *run, vshi_cast_views *views,
                           vsh_error *error) {
    const vsh_mesh mesh = vsh_model_mesh(masks->model, index, -1);
    masked_mesh mm;
    *views = (vshi_cast_views){.meshes = {mesh}, .count = 1};
    VSHI_TRY(read_mesh(masks, index, run, &mm, error));
    if (mm.material == NULL) {
        return VSH_OK;
    }
    const vshi_material *given = &mm.given;
    material *m = mm.material;
    shape *s = mm.shape;
    const bool faint = given->alpha == VSH_ALPHA_MASKED && s->vertices.uniform &&
                       given->base_alpha * s->vertices.factor < given->alpha_cutoff;
    if (m->state == NOTHING || faint) {
        *views = (vshi_cast_views){.count = 0, .cut = true};
        return VSH_OK;
    }
    if (m->state != BY_MASK && !s->masked) {
        return VSH_OK;
    }
    vsh_mesh textured = vsh_model_mesh(masks->model, index, given->uv_set);
    textured.uvs = m->state == BY_MASK ? textured.uvs : s->vertices.uvs;
    if (textured.uvs == NULL && !s->sorted) {
        vshi_warn(run,
                  "%s: %s: no UV set %d for the texture of its material, so it casts whole; export its UVs",
                  masks->path, vshi_mesh_label(&mesh, index).text, given->uv_set);
        s->sorted = true;
        s->opaque_count = mesh.triangle_count;
    }
    if (!s->sorted) {
        VSHI_TRY(sort_shape(m, &textured, run, s, error));
    }
    if (s->opaque_count == mesh.triangle_count) {
        return VSH_OK;
    }
    *views = (vshi_cast_views){.count = 0, .cut = true};
    if (s->opaque_count > 0) {
        vsh_mesh *opaque = &views->meshes[views->count++];
        *opaque = mesh;
        opaque->indices = s->opaque;
        opaque->triangle_count = s->opaque_count;
    }
    if (s->mixed_count > 0) {
        vsh_mesh *cut = &views->meshes[views->count++];
        *cut = mesh;
        cut->indices = s->mixed != NULL ? s->mixed : mesh.indices;
        cut->triangle_count = s->mixed_count;
        cut->mask = s->masked ? &s->mask : &m->mask;
        cut->mask_uvs = textured.uvs;
        cut->solidity = VSH_SOLIDITY_SHELL;
        cut->alpha = VSH_ALPHA_MASKED;
    }
    return VSH_OK;
}
