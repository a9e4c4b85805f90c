/* Skins of Assimp's meshes, at rest: each vertex moved by the nodes that its bones are. */
#ifndef VSHI_CASTER_MODEL_SKIN_H
#define VSHI_CASTER_MODEL_SKIN_H

#include "model/model.h"

struct aiNode;

/* A sum of matrices and of weights for each vertex. */
enum { VSHI_SKIN_BYTES_A_VERTEX = 13 * 8 };

/* What is known of a scene's nodes and meshes on the way. Begin with `source`, the rest 0. */
typedef struct vshi_skins {
    const vshi_model_source *source;
    double root[12];              /* in front of the scene's own root */
    struct vshi_skin_node *nodes; /* by their names; NULL: not yet looked for */
    size_t node_count;
    bool *done; /* of each mesh */
} vshi_skins;

/* parent × the node's own transform. */
void vshi_node_world(const double parent[12], const struct aiNode *node, double world[12]);

/* Moves the vertices of mesh `mesh` into the world: Σ weight × bone's node × offset matrix; vertices without
 * a bone stay under `world`. Does so once, whatever nodes use the mesh. Errors: VSH_ERROR_INPUT (a bone
 * without a node, a vertex out of range, a weight that is not finite), VSH_ERROR_MEMORY. */
vsh_result vshi_skins_apply(vshi_skins *skins, size_t mesh, vshi_model_shape *shape, const double world[12],
                            vsh_error *error);

void vshi_skins_free(vshi_skins *skins);

#endif
