// OpenVDB's grid of floats and its tree, for all files of this room.
#include "levelset/grid.h"

template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
template class openvdb::Grid<openvdb::FloatTree>;
