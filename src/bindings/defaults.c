/* What bindings call instead of the headers' inline functions. */
#include "base/memory.h"

#include <vdbshade/vdbshade.h>

#define INIT(type, defaults)                                                                                 \
    void type##_init(type *made, size_t size) {                                                              \
        const type known = defaults();                                                                       \
        vshi_give(made, size, &known, sizeof known);                                                         \
    }

/* The caller's size, whatever this library knows. */
#define INIT_SIZED(type, defaults)                                                                           \
    void type##_init(type *made, size_t size) {                                                              \
        const type known = defaults();                                                                       \
        vshi_give(made, size, &known, sizeof known);                                                         \
        made->struct_size = size;                                                                            \
    }

INIT_SIZED(vsh_bake_job_options, vsh_bake_job_options_default)
INIT_SIZED(vsh_bake_stats, vsh_bake_stats_zero)
INIT_SIZED(vsh_camera, vsh_camera_default)
INIT_SIZED(vsh_compare_files_options, vsh_compare_files_options_default)
INIT_SIZED(vsh_compare_options, vsh_compare_options_default)
INIT_SIZED(vsh_field_options, vsh_field_options_default)
INIT_SIZED(vsh_flat_options, vsh_flat_options_default)
INIT_SIZED(vsh_grid_options, vsh_grid_options_default)
INIT_SIZED(vsh_image_options, vsh_image_options_default)
INIT_SIZED(vsh_layer, vsh_layer_default)
INIT_SIZED(vsh_lightmap_options, vsh_lightmap_options_default)
INIT_SIZED(vsh_mask_options, vsh_mask_options_default)
INIT_SIZED(vsh_occluder_parts, vsh_occluder_parts_default)
INIT_SIZED(vsh_occluders_options, vsh_occluders_options_default)
INIT_SIZED(vsh_provenance_source, vsh_provenance_source_default)
INIT_SIZED(vsh_query_output, vsh_query_output_default)
INIT_SIZED(vsh_render_options, vsh_render_options_default)
INIT_SIZED(vsh_row_sink, vsh_row_sink_default)
INIT_SIZED(vsh_run, vsh_run_default)
INIT_SIZED(vsh_scene_occluders_options, vsh_scene_occluders_options_default)
INIT_SIZED(vsh_shade_options, vsh_shade_options_default)
INIT_SIZED(vsh_shade_stats, vsh_shade_stats_zero)
INIT_SIZED(vsh_strided_points, vsh_strided_points_default)
INIT_SIZED(vsh_text_options, vsh_text_options_default)
INIT_SIZED(vsh_volume_options, vsh_volume_options_default)
INIT(vsh_light, vsh_light_default)
INIT(vsh_sdf_node, vsh_sdf_node_default)
