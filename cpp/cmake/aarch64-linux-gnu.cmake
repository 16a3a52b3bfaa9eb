# Cross-compiles for 64-bit ARM Linux on Debian (g++-aarch64-linux-gnu) and runs what was built in an
# emulator (qemu-user). The compiler looks into /usr/include as well, last, and so finds Eigen and
# doctest; what is there for this machine's processor alone lies in a folder that it does not know.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64;-L;/usr/aarch64-linux-gnu")
