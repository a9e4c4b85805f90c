/* What the camera sees: of casters that have triangles these, and of the others a field for each colour.
 * Those of a layer are all in one field, which knows nothing of casters; where they differ in colour, or some
 * have triangles, each colour gets a field of its own, for camera rays alone. */
#include "cli/casters.h"
#include "cli/try.h"
#include "render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double default_color = 0.6; /* so that full light is not white */

/* Whether a caster is shown as its triangles. */
static bool is_shown_as_mesh(const vsh_assets *assets, size_t index) {
    size_t count = 0;
    vsh_assets_caster(assets, index, &count);
    return count > 0;
}

bool render_shows_fields(const vsh_scene *scene, const vsh_assets *assets) {
    bool shows = false;
    for (size_t i = 0; i < scene->caster_count && !shows; ++i) {
        shows = !is_shown_as_mesh(assets, i);
    }
    return shows;
}

void render_color_of(const vsh_caster *caster, double color[3]) {
    const bool given =
        caster != NULL && (caster->color[0] > 0.0 || caster->color[1] > 0.0 || caster->color[2] > 0.0);
    for (int c = 0; c < 3; ++c) {
        color[c] = given ? caster->color[c] : default_color;
    }
}

/* Whether the same field can show both. */
static bool same_color(const vsh_caster *a, const vsh_caster *b) {
    double one[3], other[3];
    if (cli_caster_is_direct(a) != cli_caster_is_direct(b)) {
        return false;
    }
    render_color_of(a, one);
    render_color_of(b, other);
    return memcmp(one, other, sizeof one) == 0;
}

static bool same_layer(const char *a, const char *b) {
    return a == NULL || b == NULL ? a == b : strcmp(a, b) == 0;
}

/* Caster `index`'s group: that of the first caster without triangles in its layer of its colour. */
static size_t group_of(const vsh_scene *scene, const vsh_assets *assets, size_t index) {
    const vsh_caster *caster = &scene->casters[index];
    size_t first = 0;
    while (is_shown_as_mesh(assets, first) || !same_layer(scene->casters[first].layer, caster->layer) ||
           !same_color(&scene->casters[first], caster)) {
        ++first;
    }
    return first;
}

/* The field of a layer, or (NULL) of casters in none. */
static const vsh_field *field_of(const vsh_occluder_parts *parts, const char *layer) {
    const vsh_field *field = layer == NULL ? parts->field : NULL;
    for (size_t l = 0; layer != NULL && field == NULL && l < parts->layer_count; ++l) {
        const vsh_layer *own = &parts->layers[l];
        field = own->field != NULL && strcmp(own->name, layer) == 0 ? own->field : NULL;
    }
    return field;
}

/* Whether all casters of a layer have one colour and no triangles, and are in its field. */
static bool is_plain(const vsh_scene *scene, const vsh_assets *assets, const char *layer) {
    const vsh_caster *first = NULL;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (same_layer(caster->layer, layer)) {
            first = first == NULL ? caster : first;
            if (cli_caster_is_direct(caster) || !same_color(first, caster) || is_shown_as_mesh(assets, i)) {
                return false;
            }
        }
    }
    return true;
}

static void add(render_surfaces *s, const vsh_field *field, const vsh_caster *caster) {
    vsh_surface *surface = &s->surfaces[s->count++];
    surface->field = field;
    render_color_of(caster, surface->color);
}

/* Counts the triangles' casters, and takes them where there is room for them. */
static void add_meshes(const vsh_scene *scene, const vsh_assets *assets, render_surfaces *s) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (is_shown_as_mesh(assets, i)) {
            vsh_lit_meshes *shown = &s->meshes[s->mesh_count++];
            shown->meshes = vsh_assets_caster(assets, i, &shown->mesh_count);
            render_color_of(&scene->casters[i], shown->color);
        }
    }
}

/* Casters of a scene that is split by colours: a group is a layer. */
typedef struct split {
    vsh_caster *casters;
    vsh_scene_layer *layers;
    char (*names)[24];
    size_t *first; /* caster of each layer */
    size_t count;
} split;

/* Makes the fields of the groups, each of which is a layer. */
static int make_own(const vsh_scene *colored, const vsh_assets *assets, const vsh_run *run, const split *p,
                    render_surfaces *s) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = 1; /* which are seen */
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_scene_occluders(colored, assets, &what, run, &s->own, &error), &error));
    vsh_occluder_parts own;
    vsh_occluders_get_parts(s->own, &own);
    for (size_t k = 0; k < own.layer_count; ++k) {
        add(s, own.layers[k].field, &colored->casters[p->first[k]]);
    }
    return CLI_OK;
}

static int make_split(const vsh_scene *scene, const vsh_assets *assets, const vsh_occluders *occluders,
                      const vsh_run *run, split *p, render_surfaces *s) {
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(occluders, &parts);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_field *field = field_of(&parts, scene->casters[i].layer);
        p->casters[i] = scene->casters[i];
        p->casters[i].layer = p->names[i];
        if (is_shown_as_mesh(assets, i)) {
            snprintf(p->names[i], sizeof p->names[i], "mesh"); /* no layer that is made */
            continue;
        }
        const size_t group = group_of(scene, assets, i);
        snprintf(p->names[i], sizeof p->names[i], "%zu", group);
        if (group == i && is_plain(scene, assets, scene->casters[i].layer)) {
            add(s, field, &scene->casters[i]);
        } else if (group == i) {
            vsh_field_info info = {.voxel_size = 0.0}; /* the scene's, or by its resolution */
            if (!cli_caster_is_direct(&scene->casters[i])) {
                vsh_field_get_info(field, &info);
            }
            p->first[p->count] = i;
            p->layers[p->count++] = (vsh_scene_layer){
                .name = p->names[i], .voxel_size = info.voxel_size, .shade = vsh_layer_default()};
        }
    }
    if (p->count == 0) {
        return CLI_OK;
    }
    vsh_scene colored = *scene;
    colored.casters = p->casters;
    colored.layers = p->layers;
    colored.layer_count = p->count;
    colored.light_count = 0;
    colored.ao = 0;
    bool direct = false;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        direct = direct || cli_caster_is_direct(&p->casters[i]);
        p->casters[i].direct = 0;
        p->casters[i].voxelised = 1;
    }
    vsh_assets *again = NULL; /* what is direct was not read as something to voxelise */
    vsh_error error;
    if (direct && vsh_assets_load(&colored, run, &again, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    const int code = make_own(&colored, direct ? again : assets, run, p, s);
    vsh_assets_free(again);
    return code;
}

int render_surfaces_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_occluders *occluders,
                         const vsh_run *run, render_surfaces *s) {
    *s = (render_surfaces){.count = 0};
    const size_t count = scene->caster_count;
    split p = {.casters = calloc(count, sizeof *p.casters),
               .layers = calloc(count, sizeof *p.layers),
               .names = calloc(count, sizeof *p.names),
               .first = calloc(count, sizeof *p.first)};
    s->surfaces = calloc(count, sizeof *s->surfaces);
    s->meshes = calloc(count, sizeof *s->meshes);
    const bool room = p.casters != NULL && p.layers != NULL && p.names != NULL && p.first != NULL &&
                      s->surfaces != NULL && s->meshes != NULL;
    if (room) {
        add_meshes(scene, assets, s);
    }
    const int code = room ? make_split(scene, assets, occluders, run, &p, s) : cli_out_of_memory("surfaces");
    free(p.first);
    free(p.names);
    free(p.layers);
    free(p.casters);
    return code;
}

void render_surfaces_free(render_surfaces *s) {
    free(s->meshes);
    vsh_occluders_free(s->own);
    free(s->surfaces);
}
