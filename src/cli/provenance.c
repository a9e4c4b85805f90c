#include "provenance.h"

#include "message.h"
#include "options.h"

int cli_provenance_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                        const vsh_occluders_info *casters, const vsh_run *run, cli_provenance *origin) {
    *origin = (cli_provenance){NULL, NULL, 0};
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = scene;
    source.command = cli_parsed_command();
    if (casters != NULL) {
        source.voxel_size = casters->voxel_size;
        source.has_triangles = casters->has_triangles;
    }
    source.files = files;
    source.file_count = file_count;
    vsh_error error;
    if (vsh_provenance_create(&source, run, &origin->made, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    origin->attributes = vsh_provenance_attributes(origin->made, &origin->count);
    return CLI_OK;
}

void cli_provenance_free(cli_provenance *origin) {
    vsh_provenance_free(origin->made);
    *origin = (cli_provenance){NULL, NULL, 0};
}
