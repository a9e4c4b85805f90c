/* What bindings call instead of the headers' inline functions. */
#include "base/memory.h"

#include <vdbshade/vdbshade.h>

#include <stdbool.h>
#include <string.h>

/* Structs that begin with their size, */
#define SIZED(make)                                                                                          \
    make(vsh_bake_job_options, vsh_bake_job_options_default) make(vsh_bake_stats, vsh_bake_stats_zero)       \
        make(vsh_camera, vsh_camera_default) make(vsh_compare_options, vsh_compare_options_default) make(    \
            vsh_field_options, vsh_field_options_default) make(vsh_flat_options, vsh_flat_options_default)   \
            make(vsh_grid_options, vsh_grid_options_default) make(vsh_image_options,                         \
                                                                  vsh_image_options_default)                 \
                make(vsh_layer, vsh_layer_default) make(vsh_lightmap_options, vsh_lightmap_options_default)  \
                    make(vsh_mask_options, vsh_mask_options_default) make(vsh_occluder_parts,                \
                                                                          vsh_occluder_parts_default)        \
                        make(vsh_occluders_options, vsh_occluders_options_default)                           \
                            make(vsh_provenance_source, vsh_provenance_source_default) make(                 \
                                vsh_query_output, vsh_query_output_default) make(vsh_render_options,         \
                                                                                 vsh_render_options_default) \
                                make(vsh_row_sink, vsh_row_sink_default) make(vsh_run, vsh_run_default)      \
                                    make(vsh_scene_occluders_options, vsh_scene_occluders_options_default)   \
                                        make(vsh_shade_options, vsh_shade_options_default)                   \
                                            make(vsh_shade_stats, vsh_shade_stats_zero)                      \
                                                make(vsh_strided_points, vsh_strided_points_default)         \
                                                    make(vsh_text_options, vsh_text_options_default)         \
                                                        make(vsh_volume_options, vsh_volume_options_default)

/* and others. */
#define UNSIZED(make) make(vsh_light, vsh_light_default) make(vsh_sdf_node, vsh_sdf_node_default)

#define MAKE(type, defaults)                                                                                 \
    static void make_##type(void *made, size_t size) {                                                       \
        const type known = defaults();                                                                       \
        vshi_give(made, size, &known, sizeof known);                                                         \
    }
SIZED(MAKE)
UNSIZED(MAKE)

#define SIZED_ROW(type, defaults) {#type, make_##type, true},
#define UNSIZED_ROW(type, defaults) {#type, make_##type, false},
static const struct {
    const char *name;
    void (*make)(void *made, size_t size);
    bool sized;
} structs[] = {SIZED(SIZED_ROW) UNSIZED(UNSIZED_ROW)};

int32_t vsh_struct_init(const char *name, void *made, size_t size) {
    if (name == NULL || made == NULL) {
        return 0;
    }
    for (size_t i = 0; i < sizeof structs / sizeof structs[0]; ++i) {
        if (strcmp(structs[i].name, name) == 0) {
            structs[i].make(made, size);
            if (structs[i].sized && size >= sizeof size) {
                memcpy(made, &size, sizeof size); /* the caller's, whatever this library knows */
            }
            return 1;
        }
    }
    return 0;
}
