/* The casters themselves, as rays meet them: what errors are measured against. */
#ifndef CLI_TRUTH_H
#define CLI_TRUTH_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* Triangles and procedural solids of a scene's casters; each NULL where there are none, the triangles also
 * without Embree. `seconds` (NULL: not asked for) is what the triangles' tree took. */
vsh_result cli_truth_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vsh_triangles **triangles, vsh_solids **solids, double *seconds,
                             vsh_error *error);

/* Whether rays can meet all casters: meshes and heightfields where there is Embree, procedural ones. */
bool cli_truth_traceable(const vsh_scene *scene);

typedef struct cli_truth {
    const vsh_triangles *triangles; /* both NULL: errors are not measured */
    vsh_solids *solids;
    vsh_triangles *own;
} cli_truth;

/* What a bake's values are held against: nothing where no method keeps an error, where
 * layers cast, or where memory is short. `triangles` are those that are there already, or NULL. CLI_OK,
 * or an exit code, having said why. Free with cli_truth_free() also after a failure. */
int cli_truth_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_triangles *triangles,
                   const vsh_run *run, cli_truth *truth);
void cli_truth_free(cli_truth *truth);

#endif
