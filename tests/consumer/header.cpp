/* The umbrella header is valid C++ and its functions have C linkage. */
#include <vdbshade/vdbshade.h>

#include <cstdio>

int main() {
    const vsh_run run = vsh_run_default();
    const vsh_grid_options grid = vsh_grid_options_default();
    const vsh_field_options field = vsh_field_options_default();
    const vsh_shade_options shade = vsh_shade_options_default();
    const vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    const vsh_image_options image = vsh_image_options_default();
    const vsh_query_output output = vsh_query_output_default();
    const vsh_render_options render = vsh_render_options_default();
    const vsh_light light = vsh_light_default();
    const vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_bake_stats stats = vsh_bake_stats_zero();
    const bool sized = run.struct_size == sizeof run && grid.struct_size == sizeof grid &&
                       field.struct_size == sizeof field && shade.struct_size == sizeof shade &&
                       lightmap.struct_size == sizeof lightmap && image.struct_size == sizeof image &&
                       stats.struct_size == sizeof stats && output.struct_size == sizeof output &&
                       render.struct_size == sizeof render &&
                       render.camera.struct_size == sizeof render.camera;
    std::printf("C++: vdbshade %s\n", vsh_version());
    return sized && vsh_light_check(&light, NULL) == VSH_OK && node.scale == 1.0 ? 0 : 1;
}
