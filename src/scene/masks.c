#include "scene/assets.h"

#include "base/job.h"
#include "base/memory.h"
#include "image/planes.h"
#include "mesh/alpha_mask.h"
#include "mesh/mesh.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Blended materials are opaque from here on. */
static const double HALF = 0.5;

enum { LARGEST = (1 << 16) - 1 }; /* texels along a side */

typedef enum material_state {
    NOT_READ,
    WHOLE,   /* no mask, or none that leaves anything out */
    NOTHING, /* all of it is clear */
    BY_MASK
} material_state;

typedef struct material {
    material_state state;
    bool binary; /* its texture is, and its factor leaves it so */
    vsh_alpha_mask mask;
    vshi_mask_table table; /* NULL sums: not made yet */
} material;

/* The alpha of a shape's vertex colours, which is linear over a triangle. */
typedef struct vertex_alpha {
    bool uniform;  /* all vertices have `factor`, a factor as the material's is */
    double factor; /* 0 … 1; what is not finite is 1 */
    bool binary;   /* nearly all vertices are clear or opaque, and there are some of both */
    float *uvs;    /* [count][2], for mask_by_vertices(); NULL where it is uniform */
} vertex_alpha;

/* Of a shape's triangles, those that are opaque and those that the mask cuts out; NULL where they are all, or
 * none. */
typedef struct shape {
    bool known;
    uint32_t *opaque, *mixed;
    size_t opaque_count, mixed_count;
    bool looked; /* at its vertices' alpha */
    vertex_alpha vertices;
    vsh_alpha_mask mask; /* where `masked`: its material's with that */
    bool masked;
} shape;

typedef struct texture {
    const void *of;  /* vsh_model_material.image or .image_path */
    int32_t channel; /* VSH_MASK_CHANNEL_… */
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
    const size_t materials = vsh_model_material_count(model);
    VSHI_TRY(vshi_allocate((void **)masks, 1, sizeof **masks, "alpha masks", error));
    vshi_masks *made = *masks;
    made->model = model;
    made->path = path;
    VSHI_TRY(
        vshi_allocate((void **)&made->materials, materials, sizeof *made->materials, "alpha masks", error));
    VSHI_TRY(
        vshi_allocate((void **)&made->textures, materials, sizeof *made->textures, "alpha masks", error));
    return vshi_allocate((void **)&made->shapes, model->shape_count, sizeof *made->shapes, "alpha masks",
                         error);
}

void vshi_masks_trim(vshi_masks *masks) {
    for (size_t i = 0; masks->materials != NULL && i < vsh_model_material_count(masks->model); ++i) {
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

/* Whether alphas of 8 bits are those of a cut-out, whose edges are few texels wide; smoke and glass are
 * between all over. */
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

/* 0 … 1 */
static float within(float alpha) {
    return !isfinite(alpha) || alpha > 1.0F ? 1.0F : alpha < 0.0F ? 0.0F : alpha;
}

static vsh_result fill_vertex_alpha(const float *alphas, size_t count, const char *what, const vsh_run *run,
                                    vertex_alpha *alpha, vsh_error *error) {
    uint8_t *bytes = NULL;
    vsh_result result;
    VSHI_TRY(vshi_check_limit(run, (1.0 + sizeof(float[2])) * (double)count, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, count, 1, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&alpha->uvs, count, sizeof(float[2]), what, error));
    for (size_t v = 0; v < count; ++v) {
        alpha->uvs[2 * v] = within(alphas[v]);
        bytes[v] = (uint8_t)(255.0F * alpha->uvs[2 * v] + 0.5F);
    }
    alpha->binary = is_binary(bytes, count);
done:
    free(bytes);
    return result;
}

static vsh_result find_vertex_alpha(const float *alphas, size_t count, const char *what, const vsh_run *run,
                                    vertex_alpha *alpha, vsh_error *error) {
    *alpha = (vertex_alpha){.uniform = true, .factor = count > 0 ? (double)within(alphas[0]) : 1.0};
    for (size_t v = 1; v < count && alpha->uniform; ++v) {
        alpha->uniform = (double)within(alphas[v]) == alpha->factor;
    }
    return alpha->uniform ? VSH_OK : fill_vertex_alpha(alphas, count, what, run, alpha, error);
}

/* Where base_alpha × alpha is at least alpha_cutoff, as a mask: a texture of two texels in a row, 0 and 1, is
 * looked up at a vertex's alpha, and bilinear between them is that alpha. */
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

/* What alpha is a weighted sum of; planes are NULL where there is none. */
typedef struct alpha_source {
    const float *planes[3];
    float weights[3];
} alpha_source;

static float alpha_at(const alpha_source *source, size_t texel) {
    float sum = 0.0f;
    for (int i = 0; i < 3; ++i) {
        sum += source->planes[i] != NULL ? source->weights[i] * source->planes[i][texel] : 0.0f;
    }
    return 255.0f * sum + 0.5f;
}

/* Whether it leaves anything out, in 8 bits. */
static bool varies(const alpha_source *source, size_t texels) {
    bool found = false;
    for (size_t i = 0; source->planes[0] != NULL && i < texels && !found; ++i) {
        found = !(alpha_at(source, i) >= 255.0f);
    }
    return found;
}

static alpha_source find_alpha(const vsh_image *image, int32_t channel, size_t texels) {
    static const char *const names[] = {"A", "R", "G", "B"};
    const float *grey = vshi_image_find_plane(image, "Y");
    const alpha_source luminance = {{vshi_image_find_plane(image, "R"), vshi_image_find_plane(image, "G"),
                                     vshi_image_find_plane(image, "B")},
                                    {0.2126f, 0.7152f, 0.0722f}};
    alpha_source one = {{NULL}, {1.0f, 0.0f, 0.0f}};
    if (channel <= VSH_MASK_CHANNEL_BLUE || channel == VSH_MASK_CHANNEL_AUTO) {
        one.planes[0] = vshi_image_find_plane(image, names[channel <= VSH_MASK_CHANNEL_BLUE ? channel : 0]);
    }
    if (channel == VSH_MASK_CHANNEL_ALPHA || (channel == VSH_MASK_CHANNEL_AUTO && varies(&one, texels))) {
        return one;
    }
    one.planes[0] = one.planes[0] != NULL && channel != VSH_MASK_CHANNEL_AUTO ? one.planes[0] : grey;
    return one.planes[0] != NULL ? one : luminance;
}

/* The alpha of an image, 8 bits a texel; none where it has none, or is opaque everywhere. */
static vsh_result take_alpha(const vsh_image *image, const char *path, const vsh_run *run, texture *to,
                             vsh_error *error) {
    const size_t texels = (size_t)image->width * (size_t)image->height;
    const alpha_source from = find_alpha(image, to->channel, texels);
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
        const float value = alpha_at(&from, i);
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

/* Reads the texture of a material, once however many have it. What cannot be read is opaque: the mesh is
 * there all the same. */
static vsh_result read_texture(vshi_masks *masks, const vsh_model_material *told, const vsh_run *run,
                               const texture **found, vsh_error *error) {
    const void *of = told->image != NULL ? told->image : told->image_path;
    for (size_t i = 0; i < masks->texture_count; ++i) {
        if (masks->textures[i].of == of && masks->textures[i].channel == told->image_channel) {
            *found = &masks->textures[i];
            return VSH_OK;
        }
    }
    texture *made = &masks->textures[masks->texture_count++];
    *found = made;
    made->of = of;
    made->channel = told->image_channel;
    char name[600];
    snprintf(name, sizeof name, "%.400s: the texture of material '%.100s'", masks->path,
             told->name != NULL ? told->name : "");
    vsh_image_file *file = NULL;
    vsh_error why;
    vsh_result result = told->image != NULL
                            ? vshi_image_read_bytes(name, told->image, told->image_size, run, &file, &why)
                            : vsh_image_read(told->image_path, run, &file, &why);
    if (result == VSH_OK) {
        const vsh_image image = vsh_image_view(file);
        result = take_alpha(&image, name, run, made, &why);
    }
    vsh_image_free(file);
    if (result == VSH_OK) {
        return VSH_OK;
    }
    if (is_fatal(result)) {
        return vshi_fail(error, result, "%s", why.message);
    }
    vshi_warn(run, "%s; material '%s' casts whole, without the holes of its texture", why.message,
              told->name != NULL ? told->name : "");
    return VSH_OK;
}

/* --- materials */

static vsh_result read_material(vshi_masks *masks, const vsh_model_material *told, material *m,
                                const vsh_run *run, vsh_error *error) {
    const bool masked = told->alpha == VSH_ALPHA_MASKED;
    if (m->state != NOT_READ) {
        return VSH_OK;
    }
    m->state = WHOLE;
    if (told->alpha == VSH_ALPHA_OPAQUE || (masked && !(told->alpha_cutoff > 0.0))) {
        return VSH_OK;
    }
    const texture *found = NULL;
    if (told->image != NULL || told->image_path != NULL) {
        VSHI_TRY(read_texture(masks, told, run, &found, error));
    }
    if (masked && told->base_alpha < told->alpha_cutoff) {
        m->state = NOTHING;
    } else if (found != NULL && found->alpha != NULL) {
        m->state = BY_MASK;
        m->binary = found->binary && told->base_alpha >= HALF;
        m->mask = (vsh_alpha_mask){.alpha = found->alpha,
                                   .width = found->width,
                                   .height = found->height,
                                   .wrap = {told->wrap[0], told->wrap[1]},
                                   .alpha_cutoff = masked ? told->alpha_cutoff : HALF,
                                   .base_alpha = masked ? told->base_alpha : 1.0};
        memcpy(m->mask.uv_transform, told->uv_transform, sizeof told->uv_transform);
    }
    return VSH_OK;
}

/* --- shapes */

static vshi_mask_cover cover_of(const vshi_mask_table *table, const vsh_mesh *mesh, size_t triangle) {
    vshi_mask_place places[3];
    for (size_t k = 0; k < 3; ++k) {
        const size_t vertex = mesh->indices[3 * triangle + k];
        places[k] = vshi_alpha_mask_place(table->mask, mesh->uvs + 2 * vertex);
    }
    return vshi_mask_table_cover(table, places);
}

/* A mesh's material and shape. */
typedef struct looked {
    vsh_model_material told;
    material *material; /* NULL: it has none, and so is opaque */
    shape *shape;
} looked;

/* The alpha of a mesh's vertices, where it has any and its material is not opaque, as its shape's mask. */
static vsh_result look_at_vertices(vshi_masks *masks, const looked *l, size_t mesh, const vsh_run *run,
                                   vsh_error *error) {
    const vsh_model_material told = l->told;
    const vshi_model_shape *of = &masks->model->shapes[masks->model->entries[mesh].shape];
    const material *m = l->material;
    shape *s = l->shape;
    if (s->looked) {
        return VSH_OK;
    }
    s->looked = true;
    s->vertices = (vertex_alpha){.uniform = true, .factor = 1.0};
    if (of->alphas == NULL || told.alpha == VSH_ALPHA_OPAQUE) {
        return VSH_OK;
    }
    const bool masked = told.alpha == VSH_ALPHA_MASKED;
    VSHI_TRY(find_vertex_alpha(of->alphas, of->vertex_count, masks->path, run, &s->vertices, error));
    if (m->state == WHOLE && !s->vertices.uniform && (!masked || told.alpha_cutoff > 0.0)) {
        s->masked = true;
        s->mask = masked ? mask_by_vertices(told.base_alpha, told.alpha_cutoff) : mask_by_vertices(1.0, HALF);
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

/* Finds the material and the shape of a mesh, and reads what is not known of them. */
static vsh_result look_at(vshi_masks *masks, size_t mesh, const vsh_run *run, looked *l, vsh_error *error) {
    const int32_t number = vsh_model_mesh_material(masks->model, mesh);
    *l = (looked){.shape = &masks->shapes[masks->model->entries[mesh].shape]};
    if (number < 0) {
        return VSH_OK;
    }
    l->told = vsh_model_get_material(masks->model, (size_t)number);
    l->material = &masks->materials[number];
    VSHI_TRY(read_material(masks, &l->told, l->material, run, error));
    return look_at_vertices(masks, l, mesh, run, error);
}

vsh_result vshi_masks_blend(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_blend *blend,
                            vsh_error *error) {
    looked l;
    *blend = VSHI_BLEND_GLASS;
    VSHI_TRY(look_at(masks, mesh, run, &l, error));
    const vsh_model_material told = l.told;
    const material *m = l.material;
    const shape *s = l.shape;
    if (m == NULL || told.alpha != VSH_ALPHA_BLENDED) {
        return VSH_OK;
    }
    const double factor = told.base_alpha * (s->vertices.uniform ? s->vertices.factor : 1.0);
    if (m->state == BY_MASK ? m->binary && factor >= HALF : s->vertices.binary && factor >= HALF) {
        *blend = VSHI_BLEND_CUT_OUT;
    } else if (m->state == WHOLE && told.by_texture != 0 && told.base_alpha >= 1.0) {
        *blend = VSHI_BLEND_NOTHING;
    }
    return VSH_OK;
}

static vsh_result take_list(size_t count, size_t all, const vsh_run *run, uint32_t **list, vsh_error *error) {
    if (count == 0 || count == all) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_check_limit(run, 12.0 * (double)count, "triangles of masked materials", error));
    return vshi_allocate((void **)list, 3 * count, sizeof **list, "triangles of masked materials", error);
}

/* Sorts the triangles of a view with the texture's UVs. */
static vsh_result sort(const vshi_mask_table *table, const vsh_mesh *mesh, const vsh_run *run, shape *sorted,
                       vsh_error *error) {
    unsigned char *covers = NULL;
    const size_t all = mesh->triangle_count;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&covers, all, 1, "triangles of masked materials", error));
    for (size_t i = 0; i < all; ++i) {
        covers[i] = (unsigned char)cover_of(table, mesh, i);
        sorted->opaque_count += covers[i] == VSHI_MASK_OPAQUE;
        sorted->mixed_count += covers[i] == VSHI_MASK_MIXED;
    }
    VSHI_TRY_DONE(take_list(sorted->opaque_count, all, run, &sorted->opaque, error));
    VSHI_TRY_DONE(take_list(sorted->mixed_count, all, run, &sorted->mixed, error));
    uint32_t *opaque = sorted->opaque, *mixed = sorted->mixed;
    for (size_t i = 0; i < all; ++i) {
        uint32_t **list = covers[i] == VSHI_MASK_OPAQUE ? &opaque : &mixed;
        if (covers[i] != VSHI_MASK_CLEAR && *list != NULL) {
            memcpy(*list, mesh->indices + 3 * i, 3 * sizeof **list);
            *list += 3;
        }
    }
    sorted->known = true;
done:
    free(covers);
    return result;
}

/* Its material's table is kept for other shapes. */
static vsh_result sort_by(material *m, const vsh_mesh *textured, const vsh_run *run, shape *sorted,
                          vsh_error *error) {
    vshi_mask_table own = {.sums = NULL};
    vshi_mask_table *table = sorted->masked ? &own : &m->table;
    if (table->sums == NULL) {
        VSHI_TRY(vshi_mask_table_create(sorted->masked ? &sorted->mask : &m->mask, run, table, error));
    }
    const vsh_result result = sort(table, textured, run, sorted, error);
    vshi_mask_table_free(&own);
    return result;
}

vsh_result vshi_masks_cast(vshi_masks *masks, size_t index, const vsh_run *run, vshi_cast_views *views,
                           vsh_error *error) {
    const vsh_mesh mesh = vsh_model_mesh(masks->model, index, -1);
    looked l;
    *views = (vshi_cast_views){.meshes = {mesh}, .count = 1};
    VSHI_TRY(look_at(masks, index, run, &l, error));
    if (l.material == NULL) {
        return VSH_OK;
    }
    const vsh_model_material told = l.told;
    material *m = l.material;
    shape *sorted = l.shape;
    const bool faint = told.alpha == VSH_ALPHA_MASKED && sorted->vertices.uniform &&
                       told.base_alpha * sorted->vertices.factor < told.alpha_cutoff;
    if (m->state == NOTHING || faint) {
        *views = (vshi_cast_views){.count = 0, .cut = true};
        return VSH_OK;
    }
    if (m->state != BY_MASK && !sorted->masked) {
        return VSH_OK;
    }
    vsh_mesh textured = vsh_model_mesh(masks->model, index, told.uv_set);
    textured.uvs = m->state == BY_MASK ? textured.uvs : sorted->vertices.uvs;
    if (textured.uvs == NULL && !sorted->known) {
        vshi_warn(run,
                  "%s: %s: no UV set %d for the texture of its material, so it casts whole; export its UVs",
                  masks->path, vshi_mesh_label(&mesh, index).text, told.uv_set);
        sorted->known = true;
        sorted->opaque_count = mesh.triangle_count;
    }
    if (!sorted->known) {
        VSHI_TRY(sort_by(m, &textured, run, sorted, error));
    }
    if (sorted->opaque_count == mesh.triangle_count) {
        return VSH_OK;
    }
    *views = (vshi_cast_views){.count = 0, .cut = true};
    if (sorted->opaque_count > 0) {
        vsh_mesh *opaque = &views->meshes[views->count++];
        *opaque = mesh;
        opaque->indices = sorted->opaque;
        opaque->triangle_count = sorted->opaque_count;
    }
    if (sorted->mixed_count > 0) {
        vsh_mesh *cut = &views->meshes[views->count++];
        *cut = mesh;
        cut->indices = sorted->mixed != NULL ? sorted->mixed : mesh.indices;
        cut->triangle_count = sorted->mixed_count;
        cut->mask = sorted->masked ? &sorted->mask : &m->mask;
        cut->mask_uvs = textured.uvs;
        cut->solidity = VSH_SOLIDITY_SHELL;
        cut->alpha = VSH_ALPHA_MASKED;
    }
    return VSH_OK;
}
