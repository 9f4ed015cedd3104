// The first stage: what the microcontroller starts after a reset, alone in the flash's first
// sector, which an update does not write. Starts the microcontroller's own loader if the program
// requested it (loader.rs), or if the program's checksum is wrong (hivtac-image, header.rs): then
// its update was interrupted. Starts the program otherwise. A program as an ELF has it, flashed by
// a debug probe, has no checksum and is started.

    .syntax unified

    .equ    PROGRAM,        0x08020000
    .equ    HEADER,         PROGRAM + 0x400
    .equ    CRC_OF_PROGRAM, PROGRAM + 0x45C
    .equ    MOST,           0x000E0000      // the bank's other sectors
    .equ    UNSEALED,       0x756E7365
    .equ    STARTS_AT,      0x2001FFF0      // what outlives a reset (memory.x): failed starts,
                                            // then why the microcontroller started
    .equ    STARTS,         0x53540000      // "ST", and the number of them
    .equ    MOST_FAILED,    4
    .equ    WANTED_AT,      0x2001FFF8      // a request of the program
    .equ    WANTED,         0x21554644      // "DFU!"

    .section .first_stage.vectors, "a", %progbits
    .word   _stack_start
    .word   first_stage
    .word   first_stage_fault               // NMI
    .word   first_stage_fault               // HardFault
    .space  0x40 - 16

    .section .first_stage.code, "ax", %progbits
    .balign 4
    .global first_stage
    .type   first_stage, %function
    .thumb_func
first_stage:
    ldr     r0, =0x580244D0         // RCC_RSR
    ldr     r1, [r0]
    mov     r10, r1
    tst     r1, #0x01000000         // SFTRSTF: after a reset by software memory holds what it held
    beq     1f
    ldr     r0, =WANTED_AT
    ldr     r1, [r0]
    ldr     r2, =WANTED
    cmp     r1, r2
    bne     1f
    movs    r1, #0                  // once
    str     r1, [r0]
    b       start_loader

    // The supply is the internal regulator, and no memory may be written before it is valid
    // (RM0433, 6.4.1): a fault writes. PWR_CR3 is written once after power-on; later writes do
    // nothing.
1:  ldr     r0, =0x5802480C         // PWR_CR3
    ldr     r1, [r0]
    orr     r1, #0x00000002         // LDOEN
    str     r1, [r0]
    ldr     r0, =0x58024804         // PWR_CSR1
2:  ldr     r1, [r0]
    tst     r1, #0x00002000         // ACTVOSRDY
    beq     2b

    // A program of this layout and chip?
    ldr     r6, =HEADER
    ldrd    r0, r1, [r6]
    ldr     r2, =0x54566948         // "HiVTacFW"
    cmp     r0, r2
    bne     start_loader
    ldr     r2, =0x57466361
    cmp     r1, r2
    bne     start_loader
    ldrd    r0, r1, [r6, #8]
    cmp     r0, #1                  // layout
    bne     start_loader
    cmp     r1, #0x450              // chip
    bne     start_loader
    ldr     r7, [r6, #80]           // length
    ldr     r8, [r6, #92]           // checksum
    ldr     r2, =UNSEALED
    cmp     r8, r2
    bne     3f
    movs    r6, #0
    cmp     r7, #0
    beq     start_program
3:  cmp     r7, #0x460              // with its header, and in whole flash words
    blo     start_loader
    cmp     r7, #MOST
    bhi     start_loader
    tst     r7, #31
    bne     start_loader

    // CRC-32 of its words without the checksum itself, by the CRC unit.
    ldr     r4, =0x580244E0         // RCC_AHB4ENR
    ldr     r9, [r4]
    orr     r1, r9, #0x00080000     // CRCEN
    str     r1, [r4]
    ldr     r1, [r4]                // the clock runs after this (RM0433, section 8.5.10)
    dsb
    ldr     r5, =0x58024C00         // CRC
    mov     r1, #0xFFFFFFFF
    str     r1, [r5, #0x10]         // INIT
    ldr     r1, =0x04C11DB7
    str     r1, [r5, #0x14]         // POL
    movs    r1, #0xE1               // RESET, REV_IN by word, REV_OUT
    str     r1, [r5, #8]            // CR
    ldr     r0, =PROGRAM
    add     r7, r0
    ldr     r2, =CRC_OF_PROGRAM
4:  ldr     r3, [r0], #4
    str     r3, [r5]                // DR
    cmp     r0, r2
    blo     4b
    adds    r0, #4
5:  ldr     r3, [r0], #4
    str     r3, [r5]
    cmp     r0, r7
    blo     5b
    ldr     r3, [r5]
    mvns    r3, r3
    movs    r1, #1                  // as after a reset
    str     r1, [r5, #8]
    dsb
    str     r9, [r4]
    cmp     r3, r8
    bne     start_loader

    // How many starts in a row have failed?
    movs    r6, #0
    tst     r10, #0x00A00000        // PORRSTF, BORRSTF: memory holds nothing
    bne     start_program
    tst     r10, #0x15000000        // WWDG1RSTF, IWDG1RSTF, SFTRSTF
    beq     start_program
    ldr     r5, =STARTS_AT
    ldr     r6, [r5]
    ldr     r2, =STARTS
    subs    r6, r2
    cmp     r6, #MOST_FAILED
    it      hs                      // not a count
    movhs   r6, #0
    adds    r6, #1
    cmp     r6, #MOST_FAILED
    blo     start_program
    str     r2, [r5]
    b       start_loader

    // r6: the number of failed starts before.
start_program:
    ldr     r0, =STARTS_AT
    ldr     r2, =STARTS
    adds    r2, r6
    mov     r3, r10
    strd    r2, r3, [r0]
    ldr     r0, =0x580244D0         // RCC_RSR
    ldr     r1, [r0]
    orr     r1, #0x00010000         // RMVF: the next start has its own flags only
    str     r1, [r0]
    ldr     r0, =PROGRAM
    ldr     r1, =0xE000ED08         // VTOR
    str     r0, [r1]
    dsb
    ldr     r1, [r0]
    msr     msp, r1
    ldr     r1, [r0, #4]
    bx      r1

start_loader:
    ldr     r0, =0x580244D0         // RCC_RSR: the loader starts the program by a jump (AN3156),
    ldr     r1, [r0]                // which then is not to take this reset for its own
    orr     r1, #0x00010000         // RMVF
    str     r1, [r0]
    ldr     r0, =0x1FF09800         // the loader's vectors: AN2606 has the ROM from 0x1FF00000 on,
                                    // ST's "Jump to bootloader from application on STM32H7
                                    // devices" where to enter it
    ldr     r1, =0xE000ED08         // VTOR
    str     r0, [r1]
    dsb
    ldr     r1, [r0]
    msr     msp, r1
    ldr     r1, [r0, #4]
    bx      r1

    // A flash word whose programming or erase was cut off may be a bus error when it is read. The
    // loader cannot be started from here, a fault's handler: after a reset.
    .type   first_stage_fault, %function
    .thumb_func
first_stage_fault:
    ldr     r0, =WANTED_AT
    ldr     r1, =WANTED
    str     r1, [r0]
    dsb
    ldr     r0, =0xE000ED0C         // AIRCR
    ldr     r1, =0x05FA0004         // SYSRESETREQ
    str     r1, [r0]
    dsb
6:  b       6b
    .ltorg
