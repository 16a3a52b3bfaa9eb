// A recording in memory, as make_recording.py writes it: nothing is parsed or copied, rows are read
// where they are. Little-endian, like the boards and the hosts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace replay {

struct ImuRow {
  std::int64_t t;  // [ns]
  float gyro[3];   // [rad/s], IMU frame
  float accel[3];  // specific force [m/s^2], IMU frame
};
struct CableRow {
  std::int64_t t;    // [ns]
  float lengths[9];  // [m], in the order of kPrismCables; NaN: not measured
  std::uint32_t zero;
};
struct ContactRow {
  std::int64_t t;         // [ns]
  std::uint8_t flags[6];  // 1: the endcap is on the ground
  std::uint8_t zero[2];
};
static_assert(sizeof(ImuRow) == 32 && sizeof(CableRow) == 48 && sizeof(ContactRow) == 16,
              "the layout of make_recording.py");

template <typename Row>
struct Rows {
  const Row* first;
  std::uint32_t count;

  const Row* begin() const { return first; }
  const Row* end() const { return first + count; }
};

// Each table is sorted by stamp.
struct Recording {
  Rows<ImuRow> imu;
  Rows<CableRow> cables;
  Rows<ContactRow> contacts;
};

// False when the `size` bytes of `data` (aligned to 8) are not a recording.
inline bool read(const void* data, std::size_t size, Recording& out) {
  struct Header {
    char magic[8];
    std::uint32_t imu, cables, contacts, zero;
  };
  const auto* header = static_cast<const Header*>(data);
  if (size < sizeof *header || std::memcmp(header->magic, "prism\0\0\1", 8) != 0) return false;
  const std::size_t rows = header->imu * sizeof(ImuRow) + header->cables * sizeof(CableRow) +
                           header->contacts * sizeof(ContactRow);
  if (size < sizeof *header + rows) return false;
  out.imu = {reinterpret_cast<const ImuRow*>(header + 1), header->imu};
  out.cables = {reinterpret_cast<const CableRow*>(out.imu.end()), header->cables};
  out.contacts = {reinterpret_cast<const ContactRow*>(out.cables.end()), header->contacts};
  return true;
}

}  // namespace replay
