/// simavr's headers, which are C.
#pragma once

extern "C" {
#include <avr_eeprom.h>
#include <avr_ioport.h>
#include <avr_timer.h>
#include <avr_uart.h>
#include <avr_watchdog.h>
#include <sim_avr.h>
#include <sim_core.h>
#include <sim_cycle_timers.h>
#include <sim_elf.h>
#include <sim_interrupts.h>
#include <sim_io.h>
}

namespace auvest_board {

using Cycle = avr_cycle_count_t;

}  // namespace auvest_board
