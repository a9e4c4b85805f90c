/* Loading the library does nothing to its host. It begins no thread, and OpenVDB, whose libraries do,
 * is loaded with the first level set. With an argument, the module of level sets is not there. */
#include <vdbshade/vdbshade.h>

#include <dirent.h>
#include <stdio.h>
#include <string.h>

static int threads(void) {
    DIR *tasks = opendir("/proc/self/task");
    int count = -2; /* . and .. */
    while (tasks != NULL && readdir(tasks) != NULL) {
        count++;
    }
    closedir(tasks);
    return count;
}

static int failures;

static vsh_error error;

static void expect(const char *what, int holds) {
    printf("%-60s %s\n", what, holds ? "ok" : error.message);
    failures += !holds;
}

static double ball(void *user, const double position[3]) {
    (void)user;
    return position[0] * position[0] + position[1] * position[1] + position[2] * position[2] - 1.0;
}

int main(int argc, char **argv) {
    (void)argv;
    expect("one thread at the start", threads() == 1);
    static const float corners[] = {0, 1, 0, 1, 1, 0, 0, 1, 1};
    static const uint32_t triangle[] = {0, 1, 2};
    vsh_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.positions = corners;
    mesh.vertex_count = 3;
    mesh.indices = triangle;
    mesh.triangle_count = 1;
    vsh_mesh_report report;
    expect("a mesh is checked", vsh_mesh_check(&mesh, &report, &error) == VSH_OK && report.open_edges == 3);
    vsh_grid_free(NULL);
    vsh_volume_free(NULL);
    vsh_voxels_free(NULL);
    expect("and still one", threads() == 1);
    const vsh_distance field = {ball, NULL, 2.0, 0, {-1.1, -1.1, -1.1}, {1.1, 1.1, 1.1}};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 16;
    vsh_grid *grid = (vsh_grid *)&error; /* to be overwritten */
    const vsh_result result = vsh_grid_from_distance(&field, &options, NULL, &grid, &error);
    if (argc > 1) {
        expect("without its module there is no level set", result == VSH_ERROR_UNSUPPORTED && grid == NULL);
        expect("which is named", strstr(error.message, "libvdbshade_openvdb.so") != NULL);
    } else {
        expect("the first level set is made", result == VSH_OK && grid != NULL);
    }
    vsh_grid_free(grid);
    return failures > 0;
}
