// The module as Python finds it. All it holds is in a library that the system chooses by processor
// (CMakeLists.txt).
#include <Python.h>

extern "C" PyObject* PyInit_tensegrity_python();  // module.cpp

PyMODINIT_FUNC PyInit__core() { return PyInit_tensegrity_python(); }
