#include "base/bytes.h"
#include "cli/message.h"
#include "cli/options.h"
#include "info.h"

#include <inttypes.h>
#include <stdio.h>

static void print_lines(const vsh_attribute *lines, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        printf("  %s: %s\n", lines[i].name, lines[i].value);
    }
}

static void print_field(const vsh_kept_field *field) {
    char bytes[VSHI_BYTES_ROOM], grid[VSHI_BYTES_ROOM];
    vsh_field_info info;
    vsh_field_get_info(field->field, &info);
    if (field->name[0] != '\0') {
        printf("field of layer '%s'\n", field->name);
    } else {
        printf("field\n");
    }
    printf("  voxel size: %g\n", info.voxel_size);
    printf("  bounds: %g %g %g to %g %g %g\n", info.bounds_min[0], info.bounds_min[1], info.bounds_min[2],
           info.bounds_max[0], info.bounds_max[1], info.bounds_max[2]);
    printf("  active voxels: %" PRIu64 ", level set of %s\n", info.active_voxels,
           vshi_bytes_text(field->grid_bytes, grid, sizeof grid));
    printf("  levels: %d, %" PRIu64 " bricks, %s\n", info.levels, info.bricks,
           vshi_bytes_text(info.bytes, bytes, sizeof bytes));
    if (field->band_bytes > 0) {
        printf("  band: its voxels, for 'volume', %s\n",
               vshi_bytes_text(field->band_bytes, grid, sizeof grid));
    }
    print_lines(field->origin, field->origin_count);
}

int cli_info_field(const char *path, const vsh_run *run) {
    vsh_field_file *file;
    vsh_error error;
    if (vsh_field_file_open(path, run, &file, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    char bytes[VSHI_BYTES_ROOM];
    const size_t count = vsh_field_file_count(file);
    printf("fields: %zu, %s\n", count, vshi_bytes_text(vsh_field_file_bytes(file), bytes, sizeof bytes));
    size_t line_count;
    const vsh_attribute *lines = vsh_field_file_attributes(file, &line_count);
    print_lines(lines, line_count);
    for (size_t i = 0; i < count; ++i) {
        vsh_kept_field field;
        vsh_field_file_get(file, i, &field);
        print_field(&field);
    }
    vsh_field_file_close(file);
    return CLI_OK;
}
