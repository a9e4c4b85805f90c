/* Where an output comes from: version, settings and a hash of every input, as text that the output carries.
 */
#ifndef VDBSHADE_PROVENANCE_H
#define VDBSHADE_PROVENANCE_H

#include "digest.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What an output was made of. A view. */
typedef struct vsh_provenance_source {
    size_t struct_size;
    const vsh_scene *scene;   /* with the options put over it; may be NULL */
    const char *const *files; /* [file_count]: inputs beside those that the scene names, its own file first */
    size_t file_count;
    const char *command;             /* how it was asked for, where it was by a command; may be NULL */
    double voxel_size;               /* of the level set that casts, scene units; 0: there is none */
    const vsh_attribute *attributes; /* [attribute_count]: what else there is to be told; values are cut to
                                        one line */
    size_t attribute_count;
    int32_t has_triangles; /* of vsh_occluders_info: tells what auto came to */
    int32_t lightmap;      /* nonzero: of a lightmap, which has what scene->planes asks for */
} vsh_provenance_source;

static inline vsh_provenance_source vsh_provenance_source_default(void) {
    vsh_provenance_source source = {sizeof(vsh_provenance_source), NULL, NULL, 0, NULL, 0.0, NULL, 0, 0, 0};
    return source;
}

/* Attributes that do not vary between two runs: no date, host, path or number of threads is in them. In this
 * order, where there is something to tell:
 * - vdbshade_version: "0.2.0";
 * - vdbshade_command;
 * - vdbshade_shadow: "exact, max error 0.02, 64 rays, sobol"; vdbshade_ao: "cones, 16 within 2";
 *   vdbshade_sky: "exact over y, max error 0.02, sobol";
 * - vdbshade_light_NAME: type, place and size of each light;
 * - vdbshade_voxel_size;
 * - those of the source;
 * - vdbshade_input_N: "sha256:… NAME" of each input, from N = 0: the source's files, then those of casters
 *   and receivers, then what is read with models (.bin files, .mtl files, textures that cut out), each once;
 *   what is outside of its model's folder only with run->allow_outside. */
typedef struct vsh_provenance vsh_provenance;

/* Reads every input once, to hash it. Free the result with vsh_provenance_free(). Errors:
 * - VSH_ERROR_ARGUMENT: source or provenance NULL, run;
 * - VSH_ERROR_READ: as vsh_file_digest();
 * - VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (under the stage "hash"). */
VSH_API vsh_result vsh_provenance_create(const vsh_provenance_source *source, const vsh_run *run,
                                         vsh_provenance **provenance, vsh_error *error);

/* The attributes, which belong to the provenance; none of NULL. Cannot fail. */
VSH_API const vsh_attribute *vsh_provenance_attributes(const vsh_provenance *provenance, size_t *count);

/* The standard error that the values of a channel ("ao", "sky", "shadow.NAME") were made to, as attributes
 * say that a file carries; NaN where they don't, or where a limit of rays was given, by which it may be
 * missed. Cannot fail. */
VSH_API double vsh_provenance_max_error(const vsh_attribute *attributes, size_t count, const char *channel);

VSH_API void vsh_provenance_free(vsh_provenance *provenance); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
