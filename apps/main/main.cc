// The main of every program but `trueline`: it runs the one verb that is linked to it.
#include "problems/common/app.h"

int main(int argc, char** argv) { return trueline::AllVerbs().front()->Main(argc, argv); }
