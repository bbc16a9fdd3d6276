"""What kedfem promises of damaged input, kills and full disks, tried at random; see docs/reliability.md."""
