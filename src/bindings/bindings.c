/* Functions for bindings: defaults of structs by their names, as the headers' functions are inline, and
 * progress for languages with slow callbacks. And the reader's parsers for each kind of file. */
#include "bindings/bindings.h"
#include "base/clock.h"
#include "io/image/image.h"
#include "io/lit/work.h"
#include "io/model/model.h"
#include "levelset/access.h"
#include "shapes/outline.h"

#include <vdbshade/vdbshade.h>

#include <pthread.h>
#include <stdbool.h>
#include <string.h>

/* Structs and their defaults. SIZED ones begin with their size. */
#define STRUCTS(SIZED, UNSIZED)                                                                              \
    SIZED(vsh_bake_options, vsh_bake_options_default)                                                        \
    SIZED(vsh_bake_stats, vsh_bake_stats_zero)                                                               \
    SIZED(vsh_camera, vsh_camera_default)                                                                    \
    SIZED(vsh_compare_files_options, vsh_compare_files_options_default)                                      \
    SIZED(vsh_compare_options, vsh_compare_options_default)                                                  \
    SIZED(vsh_flat_options, vsh_flat_options_default)                                                        \
    SIZED(vsh_grid_options, vsh_grid_options_default)                                                        \
    SIZED(vsh_image_options, vsh_image_options_default)                                                      \
    SIZED(vsh_lightmap_options, vsh_lightmap_options_default)                                                \
    SIZED(vsh_lit_options, vsh_lit_options_default)                                                          \
    SIZED(vsh_mask_options, vsh_mask_options_default)                                                        \
    SIZED(vsh_occluders_options, vsh_occluders_options_default)                                              \
    SIZED(vsh_point_layout, vsh_point_layout_default)                                                        \
    SIZED(vsh_provenance_source, vsh_provenance_source_default)                                              \
    SIZED(vsh_query_output, vsh_query_output_default)                                                        \
    SIZED(vsh_render_options, vsh_render_options_default)                                                    \
    SIZED(vsh_run, vsh_run_default)                                                                          \
    SIZED(vsh_scene_occluders_options, vsh_scene_occluders_options_default)                                  \
    SIZED(vsh_shade_options, vsh_shade_options_default)                                                      \
    SIZED(vsh_shade_stats, vsh_shade_stats_zero)                                                             \
    SIZED(vsh_stitch_options, vsh_stitch_options_default)                                                    \
    SIZED(vsh_text_options, vsh_text_options_default)                                                        \
    SIZED(vsh_unwrap_options, vsh_unwrap_options_default)                                                    \
    SIZED(vsh_view_bake, vsh_view_bake_default)                                                              \
    SIZED(vsh_volume_options, vsh_volume_options_default)                                                    \
    UNSIZED(vsh_caster, vsh_caster_default)                                                                  \
    UNSIZED(vsh_flat_scene, vsh_flat_scene_default)                                                          \
    UNSIZED(vsh_light, vsh_light_default)                                                                    \
    UNSIZED(vsh_receiver, vsh_receiver_default)                                                              \
    UNSIZED(vsh_scene, vsh_scene_default)                                                                    \
    UNSIZED(vsh_scene_layer, vsh_scene_layer_default)                                                        \
    UNSIZED(vsh_sdf_node, vsh_sdf_node_default)

#define MAKE(type, defaults)                                                                                 \
    static void make_##type(void *made, size_t size) {                                                       \
        const type known = defaults();                                                                       \
        memcpy(made, &known, size < sizeof known ? size : sizeof known);                                     \
    }
STRUCTS(MAKE, MAKE)

#define SIZED(type, defaults) {#type, make_##type, true},
#define UNSIZED(type, defaults) {#type, make_##type, false},
static const struct {
    const char *name;
    void (*make)(void *made, size_t size);
    bool sized;
} structs[] = {STRUCTS(SIZED, UNSIZED)};

int32_t vshi_struct_init(const char *name, void *made, size_t size) {
    if (name == NULL || made == NULL) {
        return 0;
    }
    for (size_t i = 0; i < sizeof structs / sizeof structs[0]; ++i) {
        if (strcmp(structs[i].name, name) == 0) {
            structs[i].make(made, size);
            if (structs[i].sized && size >= sizeof size) {
                memcpy(made, &size, sizeof size); /* the caller's */
            }
            return 1;
        }
    }
    return 0;
}

/* Needs no lock: one thread at a time calls a vsh_progress_fn. */
int32_t vshi_progress_seldom(void *given, const char *stage, double fraction) {
    vshi_progress_filter *filter = given;
    if (filter == NULL || filter->progress == NULL || filter->answered != 0) {
        return filter != NULL ? filter->answered : 0;
    }
    if (filter->thread != 0 && filter->thread != (uint64_t)pthread_self()) {
        return 0;
    }
    const double now = vshi_seconds();
    if (fraction <= 0.0 || fraction >= 1.0 || now - filter->last >= filter->seconds) {
        filter->answered = filter->progress(filter->user, stage, fraction);
        filter->last = vshi_seconds(); /* without the callback's own time */
    }
    return filter->answered;
}

int32_t vsh_reader_serve(int argc, char **argv) {
    static vshi_serve_fn *const servers[VSHI_READ_KINDS] = {
        [VSHI_READ_GRID] = vshi_serve_grid,     [VSHI_READ_LIST] = vshi_serve_list,
        [VSHI_READ_VOXELS] = vshi_serve_voxels, [VSHI_READ_MODEL] = vshi_serve_model,
        [VSHI_READ_IMAGE] = vshi_serve_image,   [VSHI_READ_TEXT] = vshi_serve_text,
        [VSHI_READ_COPY] = vshi_serve_copy,     [VSHI_READ_DRACO] = vshi_serve_draco,
    };
    return vshi_serve(servers, argc, argv);
}
