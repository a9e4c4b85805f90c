#include "cli/casters.h"

double cli_casters_kept_voxel_size(const vsh_scene *scene) {
    const vsh_field_file *file = scene->field;
    for (size_t i = 0; i < vsh_field_file_count(file); ++i) {
        vsh_kept_field kept;
        vsh_field_file_get(file, i, &kept);
        if (kept.name[0] == '\0') {
            vsh_field_info info;
            vsh_field_get_info(kept.field, &info);
            return info.voxel_size;
        }
    }
    return 0.0;
}
